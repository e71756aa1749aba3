#include "client/sdk/watch_stream.h"

#include <algorithm>

namespace crumple::client {
namespace {

Error internal(const Error& error) { return {ErrorCode::internal, "payload", error.text()}; }

}  // namespace

Result<std::optional<Update>> UpdateDecoder::decode(const EncodedUpdate& update) {
  if (const auto* topology = std::get_if<EncodedTopology>(&update)) {
    const auto whole = stream_.take_topology(*topology->payload);
    if (!whole) return std::unexpected(internal(whole.error()));
    if (!*whole) return std::nullopt;
    return stream_.topology();
  }
  if (const auto* encoded = std::get_if<EncodedFrame>(&update)) {
    auto frame = stream_.decode_frame(*encoded->payload);
    if (!frame) return std::unexpected(internal(frame.error()));
    return *std::move(frame);
  }
  if (const auto* event = std::get_if<WorldEvent>(&update)) return *event;
  return std::get<EventGap>(update);
}

Result<std::optional<Update>> WatchStream::next(std::chrono::milliseconds timeout) {
  using std::chrono::steady_clock;
  const auto deadline = steady_clock::now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now());
    const auto encoded = next_encoded(std::max(left, std::chrono::milliseconds(0)));
    if (!encoded) return std::unexpected(encoded.error());
    if (!*encoded) return std::nullopt;
    auto update = decoder_.decode(**encoded);
    if (!update) return std::unexpected(update.error());
    if (*update) return update;
  }
}

Subscription::Subscription(std::unique_ptr<WatchStream> stream, std::function<void(const Update&)> on_update,
                           std::function<void(const Error&)> on_end)
    : stream_(std::move(stream)),
      thread_([this, on_update = std::move(on_update), on_end = std::move(on_end)](std::stop_token stop) {
        while (!stop.stop_requested()) {
          const auto update = stream_->next(std::chrono::hours(1));
          if (stop.stop_requested()) return;
          if (!update) {
            if (on_end) on_end(update.error());
            return;
          }
          if (*update) on_update(**update);
        }
      }) {}

Subscription::~Subscription() {
  thread_.request_stop();
  stream_->close();
}

}  // namespace crumple::client
