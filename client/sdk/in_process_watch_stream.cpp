#include "client/sdk/in_process_watch_stream.h"

namespace crumple::client {
namespace {

WorldEvent from_core(const sim::Event& event) {
  static_assert(static_cast<int>(sim::EventKind::fracture) + 1 == static_cast<int>(EventKind::fracture));
  static_assert(static_cast<int>(sim::EventKind::parted) + 1 == static_cast<int>(EventKind::parted));
  const auto kind = static_cast<EventKind>(static_cast<int>(event.kind) + 1);
  return {event.sequence, event.step,  event.time,      kind,        event.body,   event.point,
          event.magnitude, event.count, event.fragments, event.epoch, event.message, event.particles};
}

// All deliveries but Closed.
struct ToUpdate {
  EncodedUpdate operator()(const EventGap& gap) const { return gap; }
  EncodedUpdate operator()(const runtime::SharedEvent& event) const { return from_core(*event); }
  EncodedUpdate operator()(const runtime::TopologyDelivery& topology) const {
    return EncodedTopology{topology.epoch, topology.base, topology.part, topology.parts, topology.payload};
  }
  EncodedUpdate operator()(const runtime::FrameDelivery& delivery) const {
    const Frame& frame = delivery.frame->frame();
    return EncodedFrame{frame.step, frame.time, frame.epoch, frame.step_ms, frame.real_time_factor, delivery.payload};
  }
  EncodedUpdate operator()(const runtime::Closed&) const { return EventGap{}; }
};

}  // namespace

InProcessWatchStream::InProcessWatchStream(runtime::FrameHub& hub, const WatchOptions& options) {
  runtime::ReaderOptions reader;
  reader.format = {options.codec, options.compress, options.values};
  reader.max_rate_hz = options.max_rate_hz;
  reader.credits = options.credits;
  reader.after_event = options.after_event;
  reader_ = hub.subscribe(reader, [signal = signal_] {
    const std::lock_guard lock(signal->mutex);
    signal->raised = true;
    signal->wake.notify_all();
  });
}

Result<std::optional<EncodedUpdate>> InProcessWatchStream::next_encoded(std::chrono::milliseconds timeout) {
  if (std::exchange(owes_credit_, false)) reader_->grant(1);
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  std::unique_lock lock(signal_->mutex);
  while (true) {
    if (signal_->closed) return std::unexpected(Error{ErrorCode::unavailable, "", "the stream was closed"});
    if (end_) return std::unexpected(*end_);
    signal_->raised = false;
    lock.unlock();
    const std::optional<runtime::Delivery> delivery = reader_->poll();
    lock.lock();
    if (!delivery) {
      if (!signal_->wake.wait_until(lock, deadline, [&] { return signal_->raised || signal_->closed; })) return std::nullopt;
    } else if (const auto* closed = std::get_if<runtime::Closed>(&*delivery)) {
      end_ = closed->reason;
    } else {
      owes_credit_ = std::holds_alternative<runtime::FrameDelivery>(*delivery);
      return std::visit(ToUpdate{}, *delivery);
    }
  }
}

void InProcessWatchStream::close() {
  const std::lock_guard lock(signal_->mutex);
  signal_->closed = true;
  signal_->wake.notify_all();
}

}  // namespace crumple::client
