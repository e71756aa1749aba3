#include "client/sdk/watch_stream.h"

namespace crumple::client {
namespace {

template <class T>
Result<Update> as_update(Result<T> value) {
  if (value) return Update(*std::move(value));
  return std::unexpected(Error{ErrorCode::internal, "payload", value.error().text()});
}

struct Decode {
  Result<Update> operator()(const EncodedTopology& topology) const { return as_update(decode_topology(*topology.payload)); }
  Result<Update> operator()(const EncodedFrame& frame) const { return as_update(decode_frame(*frame.payload)); }
  Result<Update> operator()(const WorldEvent& event) const { return event; }
  Result<Update> operator()(const EventGap& gap) const { return gap; }
};

}  // namespace

Result<Update> decode(const EncodedUpdate& update) { return std::visit(Decode{}, update); }

Result<std::optional<Update>> WatchStream::next(std::chrono::milliseconds timeout) {
  const auto encoded = next_encoded(timeout);
  if (!encoded) return std::unexpected(encoded.error());
  if (!*encoded) return std::nullopt;
  auto update = decode(**encoded);
  if (!update) return std::unexpected(update.error());
  return *std::move(update);
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
