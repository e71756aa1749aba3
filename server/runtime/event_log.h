#pragma once

#include "common/world_status.h"
#include "server/sim/event.h"

#include <cstddef>
#include <deque>
#include <memory>
#include <variant>

namespace crumple::runtime {

using SharedEvent = std::shared_ptr<const sim::Event>;

// The last events of a world, in order and without gaps in their numbers. Not thread-safe.
class EventLog {
 public:
  explicit EventLog(std::size_t capacity) : capacity_(capacity) {}

  void append(sim::Event event);  // event.sequence must be last() + 1
  std::uint64_t last() const { return last_; }  // number of the newest event; 0: none yet

  // What follows event number `after`: the next event, the gap of those that are no longer here, or nothing.
  std::variant<std::monostate, SharedEvent, EventGap> next(std::uint64_t after) const;

 private:
  std::size_t capacity_;
  std::uint64_t last_ = 0;
  std::deque<SharedEvent> events_;
};

}  // namespace crumple::runtime
