#include "server/runtime/event_log.h"

#include <cassert>

namespace crumple::runtime {

void EventLog::append(sim::Event event) {
  assert(event.sequence == last_ + 1);
  last_ = event.sequence;
  particles_ += event.particles.size();
  events_.push_back(std::make_shared<const sim::Event>(std::move(event)));
  while (events_.size() > capacity_ || (particles_ > most_particles_ && events_.size() > 1)) {
    particles_ -= events_.front()->particles.size();
    events_.pop_front();
  }
}

std::variant<std::monostate, SharedEvent, EventGap> EventLog::next(std::uint64_t after) const {
  if (after >= last_) return {};
  const std::uint64_t first_kept = last_ - events_.size() + 1;
  if (after + 1 < first_kept) return EventGap{after + 1, first_kept - 1};
  return events_[after + 1 - first_kept];
}

}  // namespace crumple::runtime
