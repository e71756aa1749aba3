#pragma once

#include "common/dust_particle.h"

#include <string>
#include <vector>

// What happened in a world that a client must not miss. Events are ordered and numbered, never dropped, never merged.
namespace crumple::sim {

enum class EventKind : std::uint8_t {
  fracture,    // a finite-element body split nodes: `count` splits, `fragments` connected components now
  topology,    // the drawn topology changed: `epoch`
  dent,        // an example-based body took a plastic impulse of `magnitude` [N s]
  script,      // a scripted command was applied
  solver,      // a solve ended at its cap: `magnitude` is the residual
  frozen,      // a body's state became non-finite, or its energy grew for ever; it is held where it last was
  guard,       // an island is stepped more carefully, or normally again: `magnitude` is what was found
  dust,        // `count` grains leave the new surfaces of a finite-element body: `particles`
  parted,      // a joint of a body gave way at `point` to a force of `magnitude` [N]
  warning,     // something that the scene asks of a body may not hold: `message` says what
};

const char* name(EventKind kind);  // as spelled above

struct Event {
  std::uint64_t sequence = 0;  // from 1, without gaps
  std::uint64_t step = 0;
  double time = 0;             // [s]
  EventKind kind = EventKind::fracture;
  BodyId body = 0;
  Vec3 point = Vec3::Zero();   // in W [m], where it makes sense
  double magnitude = 0;
  int count = 0;
  int fragments = 0;
  std::uint32_t epoch = 0;
  std::string message;         // one sentence for a log
  std::vector<DustParticle> particles;
};

}  // namespace crumple::sim
