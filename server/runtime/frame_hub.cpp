#include "server/runtime/frame_hub.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace crumple::runtime {

// Shared by the hub and its readers, so that either may go first.
class HubCore {
 public:
  HubCore(std::shared_ptr<WallClock> clock, std::size_t event_capacity, std::function<void()> on_demand)
      : clock_(std::move(clock)), log_(event_capacity), on_demand_(std::move(on_demand)), thread_([this] { run(); }) {}

  void stop() {
    {
      const std::lock_guard lock(demand_mutex_);
      on_demand_ = {};
    }
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

  // Runs `what` under the lock, then has the hub's thread look at the readers again.
  template <class What>
  void change(What&& what) {
    {
      const std::lock_guard lock(mutex_);
      what();
      ++changes_;
    }
    wake_.notify_all();
  }

  void demand_changed() {
    const std::lock_guard lock(demand_mutex_);
    if (on_demand_) on_demand_();
  }

  // ---- the rest under mutex_
  static bool waits_for_frame(const FrameReader& reader, double now) {
    return reader.credits_ > 0 && !reader.after_topology_ && now >= reader.next_frame_at_;
  }
  // The published frame, if it is one that the reader can use and has not seen.
  std::shared_ptr<const PublishedFrame> fresh_frame(const FrameReader& reader) const {
    if (!published_ || !published_->serves(reader.options_.format)) return nullptr;
    return reader.step_ == published_->frame().step ? nullptr : published_;
  }
  bool has_delivery(const FrameReader& reader, double now) const {
    if (log_.last() > reader.event_) return true;
    if (closed_) return !reader.closed_;
    return reader.after_topology_ || (waits_for_frame(reader, now) && fresh_frame(reader));
  }

  std::mutex mutex_;
  const std::shared_ptr<WallClock> clock_;
  EventLog log_;
  std::shared_ptr<const PublishedFrame> published_;
  std::optional<Error> closed_;
  std::vector<FrameReader*> readers_;

 private:
  using Notify = std::shared_ptr<const std::function<void()>>;

  // Tells readers that have something to take, and wakes for those whose rate limit lets them take again.
  void run() {
    std::unique_lock lock(mutex_);
    std::uint64_t seen = 0;
    while (!stop_) {
      const bool deadline_passed = seen == changes_;
      seen = changes_;
      double deadline = WallClock::kForever;
      std::vector<Notify> ready = look_at_readers(deadline);
      lock.unlock();
      for (const Notify& notify : ready) (*notify)();
      if (deadline_passed) demand_changed();
      ready.clear();
      lock.lock();
      if (!stop_ && seen == changes_) clock_->wait_until(lock, wake_, deadline);
    }
  }

  std::vector<Notify> look_at_readers(double& deadline) const {
    std::vector<Notify> ready;
    const double now = clock_->now();
    for (const FrameReader* reader : readers_) {
      if (has_delivery(*reader, now)) ready.push_back(reader->notify_);
      if (reader->credits_ > 0 && now < reader->next_frame_at_) deadline = std::min(deadline, reader->next_frame_at_);
    }
    return ready;
  }

  std::condition_variable wake_;
  std::uint64_t changes_ = 1;
  bool stop_ = false;
  std::mutex demand_mutex_;
  std::function<void()> on_demand_;
  std::thread thread_;  // last: it starts when all else is there
};

// ---- reader -------------------------------------------------------------------------------------------------------

FrameReader::FrameReader(std::shared_ptr<HubCore> core, const ReaderOptions& options, std::function<void()> notify)
    : core_(std::move(core)), options_(options),
      notify_(std::make_shared<const std::function<void()>>(std::move(notify))),
      credits_(std::min(options.credits, kMaxCredits)) {}

FrameReader::~FrameReader() {
  const std::lock_guard lock(core_->mutex_);
  std::erase(core_->readers_, this);
}

void FrameReader::grant(std::uint32_t credits) {
  core_->change([&] { credits_ = static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{credits_} + credits, kMaxCredits)); });
  core_->demand_changed();
}

std::optional<Delivery> FrameReader::poll() {
  std::unique_lock lock(core_->mutex_);
  const auto next = core_->log_.next(event_);
  if (const auto* gap = std::get_if<EventGap>(&next)) {
    event_ = gap->last;
    step_.reset();
    epoch_.reset();
    after_topology_.reset();
    parts_sent_ = 0;
    return *gap;
  }
  if (const auto* event = std::get_if<SharedEvent>(&next)) {
    event_ = (*event)->sequence;
    return *event;
  }
  if (core_->closed_) {
    if (std::exchange(closed_, true)) return std::nullopt;
    return Closed{*core_->closed_};
  }
  std::shared_ptr<const PublishedFrame> frame = after_topology_;
  if (!frame && (!HubCore::waits_for_frame(*this, core_->clock_->now()) || !(frame = core_->fresh_frame(*this)))) return std::nullopt;
  if (const std::uint32_t epoch = frame->frame().epoch; epoch_ != epoch) {
    // This very frame comes next, whatever is published meanwhile: else a world that breaks at every step would send
    // topologies only.
    after_topology_ = frame;
    const std::optional<std::uint32_t> base = epoch_;
    const std::uint32_t part = parts_sent_++;
    lock.unlock();
    const std::vector<Payload> parts = frame->topology()->encoded(options_.format, base);
    lock.lock();
    if (parts_sent_ == parts.size()) {
      epoch_ = epoch;
      parts_sent_ = 0;
    }
    return TopologyDelivery{epoch, base, part, static_cast<std::uint32_t>(parts.size()), parts[part]};
  }
  after_topology_ = nullptr;
  --credits_;
  step_ = frame->frame().step;
  if (options_.max_rate_hz > 0) {
    const double period = 1 / options_.max_rate_hz;
    next_frame_at_ = std::max(next_frame_at_, core_->clock_->now() - period) + period;
  }
  lock.unlock();
  return FrameDelivery{frame, frame->encoded(options_.format)};
}

// ---- hub ------------------------------------------------------------------------------------------------------------

FrameHub::FrameHub(std::shared_ptr<WallClock> clock, std::size_t event_capacity, std::function<void()> on_demand)
    : core_(std::make_shared<HubCore>(std::move(clock), event_capacity, std::move(on_demand))) {}

FrameHub::~FrameHub() {
  close({ErrorCode::unavailable, "", "the world is gone"});
  core_->stop();
}

FrameHub::Demand FrameHub::demand(std::uint64_t step) const {
  const std::lock_guard lock(core_->mutex_);
  const double now = core_->clock_->now();
  const bool is_published = core_->published_ && core_->published_->frame().step == step;
  Demand demand;
  for (const FrameReader* reader : core_->readers_) {
    if (!HubCore::waits_for_frame(*reader, now) || reader->step_ == step) continue;
    if (is_published && core_->published_->serves(reader->options_.format)) continue;
    demand.frame = true;
    demand.values |= reader->options_.format.values;
  }
  return demand;
}

void FrameHub::append(std::span<const sim::Event> events) {
  if (events.empty()) return;
  core_->change([&] {
    for (const sim::Event& event : events) core_->log_.append(event);
  });
}

void FrameHub::publish(std::shared_ptr<const PublishedFrame> frame) {
  core_->change([&] { core_->published_.swap(frame); });  // the old one is destroyed outside the lock
}

void FrameHub::close(Error reason) {
  core_->change([&] {
    if (!core_->closed_) core_->closed_ = std::move(reason);
  });
}

std::unique_ptr<FrameReader> FrameHub::subscribe(const ReaderOptions& options, std::function<void()> notify) {
  std::unique_ptr<FrameReader> reader(new FrameReader(core_, options, std::move(notify)));
  core_->change([&] {
    reader->event_ = options.after_event.value_or(core_->log_.last());
    core_->readers_.push_back(reader.get());
  });
  core_->demand_changed();
  return reader;
}

int FrameHub::readers() const {
  const std::lock_guard lock(core_->mutex_);
  return static_cast<int>(core_->readers_.size());
}

}  // namespace crumple::runtime
