#pragma once

#include "client/sdk/world_event.h"
#include "common/error.h"
#include "common/frame.h"
#include "common/stream_decoder.h"
#include "common/world_status.h"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>

// What a client watches; simulation.proto, Watch, says what comes when.
namespace crumple::client {

struct WatchOptions {
  Codec codec = Codec::quantised16;
  bool compress = true;
  bool values = false;                       // want values of each vertex: BodyFrame::values
  double max_rate_hz = 0;                    // frames a second, [0, 1000]; 0: as many as are asked for
  std::uint32_t credits = 1;                 // frames on their way at once; with 1 each is the newest there is
  std::optional<std::uint64_t> after_event;  // want the events after this number; missing: from now on
};

// As received. Payloads are for a StreamDecoder.
struct EncodedTopology {
  std::uint32_t epoch = 0;
  std::optional<std::uint32_t> base;  // it has what changed since that epoch; missing: it has all bodies
  std::uint32_t part = 0, parts = 1;  // of those that it comes in
  std::shared_ptr<const std::string> payload;
};
struct EncodedFrame {
  std::uint64_t step = 0;
  double time = 0;  // simulated [s]
  std::uint32_t epoch = 0;
  double step_ms = 0;
  double real_time_factor = 0;
  std::shared_ptr<const std::string> payload;
};
using EncodedUpdate = std::variant<EncodedTopology, EncodedFrame, WorldEvent, EventGap>;
// A topology is whole, whatever was sent of it: of its bodies, those whose epoch is above that of the one before are new.
using Update = std::variant<Topology, Frame, WorldEvent, EventGap>;

// Decodes the updates of one stream or file, all of them in order.
class UpdateDecoder {
 public:
  // Nothing: a part of a topology, and more are to come. Error internal: a payload does not decode.
  Result<std::optional<Update>> decode(const EncodedUpdate& update);

 private:
  StreamDecoder stream_;
};

// An open stream. Read it with next or with next_encoded, not with both; one thread at a time. close and the destructor end it at once.
class WatchStream {
 public:
  virtual ~WatchStream() = default;

  // The next update; nothing if none came in time. A frame's credit goes back to the server when the one after it is
  // asked for. Errors: why the stream ended, the same again if asked again; internal if a payload does not decode.
  Result<std::optional<Update>> next(std::chrono::milliseconds timeout);
  virtual Result<std::optional<EncodedUpdate>> next_encoded(std::chrono::milliseconds timeout) = 0;

  virtual void close() = 0;  // from any thread; a waiting next() returns

 private:
  UpdateDecoder decoder_;
};

// Calls `on_update` for every update, and `on_end` once with the reason when the stream ends by itself, on a thread of
// its own. Neither may destroy the subscription.
class Subscription {
 public:
  Subscription(std::unique_ptr<WatchStream> stream, std::function<void(const Update&)> on_update,
               std::function<void(const Error&)> on_end);
  ~Subscription();  // ends the stream; no call after it
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

 private:
  std::unique_ptr<WatchStream> stream_;
  std::jthread thread_;
};

}  // namespace crumple::client
