#include "server/grpc/watch_reactor.h"

#include "common/text.h"
#include "server/grpc/convert.h"
#include "server/grpc/watch_message.h"

#include <grpcpp/grpcpp.h>

namespace crumple::grpc_server {
namespace {
constexpr double kMaxRate = 1000;  // [Hz]
}

WatchReactor* WatchReactor::start(const runtime::WorldRegistry& registry, grpc::CallbackServerContext& context) {
  const std::shared_ptr<WatchReactor> reactor(new WatchReactor(registry, context));
  reactor->self_ = reactor;
  reactor->StartRead(&reactor->incoming_);
  return reactor.get();
}

void WatchReactor::OnReadDone(bool ok) {
  const auto self = shared_from_this();
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  if (!ok) return finish(grpc::Status::OK);  // the client closed its side
  v1::WatchRequest request;
  if (!parse(incoming_, request)) return finish(to_status(Error{ErrorCode::invalid_argument, "", "not a WatchRequest"}));
  const Result<void> taken = take(request);
  if (!taken) return finish(to_status(taken.error()));
  StartRead(&incoming_);
  write_next();
}

Result<void> WatchReactor::take(const v1::WatchRequest& request) {
  if (!reader_) {
    if (!request.has_subscribe()) return invalid("subscribe", "is missing, must be the first request");
    return subscribe(request.subscribe());
  }
  if (request.request_case() != v1::WatchRequest::kCredits)
    return invalid(request.has_subscribe() ? "subscribe" : "request", "is a later request, must be credits");
  reader_->grant(request.credits());
  return {};
}

// The stream's initial metadata say that the subscription stands, before anything is streamed.
Result<void> WatchReactor::subscribe(const v1::Subscribe& request) {
  if (!v1::Codec_IsValid(request.codec()))
    return invalid("subscribe.codec", text("is ", static_cast<int>(request.codec()), ", there is no such codec"));
  if (!(request.max_rate_hz() >= 0 && request.max_rate_hz() <= kMaxRate))
    return invalid("subscribe.max_rate_hz", text("is ", request.max_rate_hz(), ", must lie in [0, ", kMaxRate, "]"));
  const auto world = registry_.find(request.world());
  if (!world) return std::unexpected(within("subscribe", world.error()));
  runtime::ReaderOptions options;
  options.format = {static_cast<Codec>(request.codec()), request.compress(), request.values()};
  options.max_rate_hz = request.max_rate_hz();
  options.credits = request.credits();
  if (request.has_after_event()) options.after_event = request.after_event();
  reader_ = (*world)->hub().subscribe(options, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (!self) return;
    const std::lock_guard lock(self->mutex_);
    self->write_next();
  });
  context_.AddInitialMetadata("crumple-world", std::to_string(request.world()));
  StartSendInitialMetadata();
  return {};
}

// Needs the lock.
void WatchReactor::write_next() {
  if (writing_ || finished_ || !reader_) return;
  try {
    const std::optional<runtime::Delivery> delivery = reader_->poll();
    if (!delivery) return;
    if (const auto* closed = std::get_if<runtime::Closed>(&*delivery)) return finish(to_status(closed->reason));
    outgoing_ = to_bytes(*delivery);
  } catch (const std::exception& thrown) {
    return finish(to_status(Error{ErrorCode::internal, "", text("encoding failed: ", thrown.what())}));
  }
  writing_ = true;
  StartWrite(&outgoing_);
}

void WatchReactor::OnWriteDone(bool ok) {
  const auto self = shared_from_this();
  const std::lock_guard lock(mutex_);
  writing_ = false;
  outgoing_.Clear();
  if (ok) write_next();  // else the stream is broken, and OnCancel ends it
}

void WatchReactor::OnCancel() {
  const auto self = shared_from_this();
  const std::lock_guard lock(mutex_);
  finish(grpc::Status::CANCELLED);
}

// Needs the lock. The reader goes at once: from here on nothing is captured or encoded for this stream.
void WatchReactor::finish(grpc::Status status) {
  if (std::exchange(finished_, true)) return;
  reader_.reset();
  Finish(std::move(status));
}

void WatchReactor::OnDone() { const auto last = std::move(self_); }

}  // namespace crumple::grpc_server
