#include "server/sim/world_impl.h"

#include <utility>

// What somebody who watches sees.
namespace crumple::sim {

Event& World::Impl::add_event(EventKind kind, BodyId body) {
  events.push_back({.sequence = ++event_count, .step = step, .time = time(), .kind = kind, .body = body, .epoch = topology.epoch});
  return events.back();
}

bool World::Impl::is_said(EventKind kind, BodyId body, const std::string& ending) const {
  for (auto event = events.rbegin(); event != events.rend() && event->step == step; ++event)
    if (event->kind == kind && event->body == body && event->message.ends_with(ending)) return true;
  return false;
}

std::vector<Event> World::take_events() { return std::exchange(impl_->events, {}); }

const Topology& World::topology() const { return impl_->topology; }

Frame World::capture(bool with_values) const {
  const Impl& w = *impl_;
  Frame frame{.step = w.step, .time = w.time(), .epoch = w.topology.epoch};
  frame.bodies.resize(w.places.size());
  for (BodyId id = 0; id < w.places.size(); ++id) {
    BodyFrame& body = frame.bodies[id];
    switch (w.places[id].model) {
      case BodyModel::fem: w.objects[w.places[id].index].capture(w.soft, with_values, body); break;
      case BodyModel::example_based:
        w.examples[w.places[id].index].capture(w.rigid.pose(id), with_values, body);
        break;
      default: body = {.id = id, .pose = w.rigid.pose(id)};
    }
  }
  return frame;
}

}  // namespace crumple::sim
