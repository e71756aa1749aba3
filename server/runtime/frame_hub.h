#pragma once

#include "common/error.h"
#include "common/world_status.h"
#include "server/runtime/event_log.h"
#include "server/runtime/published_frame.h"
#include "server/runtime/wall_clock.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

// Where the world's thread hands over what viewers see, and each viewer takes it at its own pace.
//
// Frames: newest wins. A frame costs the reader a credit; what was replaced before the reader had one is never
// encoded. A frame of a new epoch comes after that epoch's topology: the bodies that changed since the reader's last one,
// however many epochs it skipped, or all bodies for its first. Events: all of them, in order, before the frame
// of their step, free of credits; a reader that falls off the bounded log is told so and its next frame comes after a
// topology of all bodies. Encoding happens once per format, on the threads of the readers.
namespace crumple::runtime {

struct ReaderOptions {
  StreamFormat format;
  double max_rate_hz = 0;                   // frames a second; 0: no limit
  std::uint32_t credits = 0;                // to begin with
  std::optional<std::uint64_t> after_event; // events after this number; missing: from now on
};

struct TopologyDelivery {
  std::uint32_t epoch = 0;
  std::optional<std::uint32_t> base;   // of the topology that it changes; nothing: it has all bodies
  std::uint32_t part = 0, parts = 1;   // of those that it is sent in
  Payload payload;
};
struct FrameDelivery { std::shared_ptr<const PublishedFrame> frame; Payload payload; };
struct Closed { Error reason; };  // nothing comes after it
using Delivery = std::variant<EventGap, SharedEvent, TopologyDelivery, FrameDelivery, Closed>;

class HubCore;

// One viewer's place in the stream. Detaches when destroyed. Thread-safe, but the order of deliveries is only kept if
// one thread polls at a time.
class FrameReader {
 public:
  ~FrameReader();
  FrameReader(const FrameReader&) = delete;
  FrameReader& operator=(const FrameReader&) = delete;

  static constexpr std::uint32_t kMaxCredits = 1024;  // more are not kept
  void grant(std::uint32_t credits);

  // The next thing to send, or nothing; never waits, except for another reader's encoding of the same frame.
  std::optional<Delivery> poll();

 private:
  friend class HubCore;
  friend class FrameHub;
  FrameReader(std::shared_ptr<HubCore> core, const ReaderOptions& options, std::function<void()> notify);

  std::shared_ptr<HubCore> core_;
  const ReaderOptions options_;
  const std::shared_ptr<const std::function<void()>> notify_;
  // Below: guarded by the core's mutex.
  std::uint32_t credits_ = 0;
  std::uint64_t event_ = 0;                             // number of the last event sent
  std::optional<std::uint64_t> step_;                   // of the last frame sent
  std::optional<std::uint32_t> epoch_;                  // of the last topology sent, all its parts
  std::shared_ptr<const PublishedFrame> after_topology_;  // its topology is being sent, the frame is next
  std::uint32_t parts_sent_ = 0;                        // of that topology
  double next_frame_at_ = 0;                            // by the rate limit, wall time [s]
  bool closed_ = false;                                 // Closed is sent
};

class FrameHub {
 public:
  // `on_demand` is called, from any thread and without locks, when demand() may have changed; it must be quick.
  explicit FrameHub(std::shared_ptr<WallClock> clock = steady_wall_clock(), std::size_t event_capacity = 16384,
                    std::function<void()> on_demand = {});
  ~FrameHub();
  FrameHub(const FrameHub&) = delete;
  FrameHub& operator=(const FrameHub&) = delete;

  // ---- for the world's thread
  struct Demand {
    bool frame = false;   // a reader waits for a newer frame than the last published
    bool values = false;  // with values
  };
  Demand demand(std::uint64_t step) const;  // if `step` were captured now
  void append(std::span<const sim::Event> events);
  void publish(std::shared_ptr<const PublishedFrame> frame);
  void close(Error reason);  // readers get their remaining events, then this; the first reason stays

  // ---- for readers
  // `notify` is called from the hub's own thread, without locks, whenever poll() may have something; it may poll. One
  // such call may still be on its way when the reader is destroyed.
  std::unique_ptr<FrameReader> subscribe(const ReaderOptions& options, std::function<void()> notify);
  int readers() const;

 private:
  std::shared_ptr<HubCore> core_;
};

}  // namespace crumple::runtime
