#include "client/sdk/grpc_watch_stream.h"

#include "client/sdk/message_convert.h"

namespace crumple::client {
namespace {

constexpr std::size_t kQueue = 256;

v1::WatchRequest to_request(WorldId world, const WatchOptions& options) {
  v1::WatchRequest request;
  v1::Subscribe& subscribe = *request.mutable_subscribe();
  subscribe.set_world(world);
  subscribe.set_codec(static_cast<v1::Codec>(options.codec));
  subscribe.set_compress(options.compress);
  subscribe.set_values(options.values);
  subscribe.set_max_rate_hz(options.max_rate_hz);
  subscribe.set_credits(options.credits);
  if (options.after_event) subscribe.set_after_event(*options.after_event);
  return request;
}

}  // namespace

Result<std::unique_ptr<WatchStream>> GrpcWatchStream::open(v1::SimulationService::Stub& stub, WorldId world,
                                                           const WatchOptions& options) {
  std::unique_ptr<GrpcWatchStream> watch(new GrpcWatchStream(stub));
  watch->stream_->Write(to_request(world, options));
  watch->stream_->WaitForInitialMetadata();
  if (!watch->context_.GetServerInitialMetadata().contains("crumple-world"))  // refused: the server has ended the call
    return std::unexpected(to_error(watch->stream_->Finish()));
  watch->reader_ = std::thread([self = watch.get()] { self->read(); });
  return watch;
}

GrpcWatchStream::~GrpcWatchStream() {
  close();
  if (reader_.joinable()) reader_.join();
}

void GrpcWatchStream::close() {
  context_.TryCancel();
  const std::lock_guard lock(mutex_);
  closed_ = true;
  wake_.notify_all();
}

void GrpcWatchStream::read() {
  v1::WatchResponse message;
  while (stream_->Read(&message)) {
    auto update = take_update(message);
    if (!update) continue;
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return closed_ || queue_.size() < kQueue; });
    if (closed_) break;
    queue_.push_back(*std::move(update));
    wake_.notify_all();
  }
  const grpc::Status status = stream_->Finish();
  const std::lock_guard lock(mutex_);
  end_ = status.ok() ? Error{ErrorCode::unavailable, "", "the server ended the stream"} : to_error(status);
  wake_.notify_all();
}

Result<std::optional<EncodedUpdate>> GrpcWatchStream::next_encoded(std::chrono::milliseconds timeout) {
  if (std::exchange(owes_credit_, false)) {
    v1::WatchRequest request;
    request.set_credits(1);
    stream_->Write(request);  // if the stream has ended, the reader knows why
  }
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, timeout, [&] { return closed_ || end_ || !queue_.empty(); });
  if (closed_) return std::unexpected(Error{ErrorCode::unavailable, "", "the stream was closed"});
  if (queue_.empty()) {
    if (end_) return std::unexpected(*end_);
    return std::nullopt;
  }
  EncodedUpdate update = std::move(queue_.front());
  queue_.pop_front();
  wake_.notify_all();
  owes_credit_ = std::holds_alternative<EncodedFrame>(update);
  return update;
}

}  // namespace crumple::client
