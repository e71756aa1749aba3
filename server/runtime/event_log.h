#pragma once

#include "common/world_status.h"
#include "server/sim/event.h"

#include <cstddef>
#include <deque>
#include <memory>
#include <variant>

namespace crumple::runtime {

using SharedEvent = std::shared_ptr<const sim::Event>;

inline constexpr std::size_t kMaxLoggedParticles = 2'000'000;  // 48 MB

// The last events of a world, in order and without gaps in their numbers; at most `capacity` of them, and fewer if they have more
// than `particles` grains of dust in all, but the newest in any case. Not thread-safe.
class EventLog {
 public:
  explicit EventLog(std::size_t capacity, std::size_t particles = kMaxLoggedParticles) : capacity_(capacity), most_particles_(particles) {}

  void append(sim::Event event);  // event.sequence must be last() + 1
  std::uint64_t last() const { return last_; }  // number of the newest event; 0: none yet

  // What follows event number `after`: the next event, the gap of those that are no longer here, or nothing.
  std::variant<std::monostate, SharedEvent, EventGap> next(std::uint64_t after) const;

 private:
  std::size_t capacity_, most_particles_;
  std::size_t particles_ = 0;
  std::uint64_t last_ = 0;
  std::deque<SharedEvent> events_;
};

}  // namespace crumple::runtime
