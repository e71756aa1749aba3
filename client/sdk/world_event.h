#pragma once

#include "common/dust_particle.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crumple::client {

// Numbered as in simulation.proto.
enum class EventKind : std::uint8_t {
  fracture = 1,  // a finite-element body split `count` nodes and is in `fragments` pieces now
  topology,      // what is drawn changed: `epoch`
  dent,          // an example-based body took a plastic impulse of `magnitude` [N s]
  script,        // a scripted command was applied
  solver,        // a solve ended at its cap with the relative residual `magnitude`
  frozen,        // a body's state became non-finite, or its energy grew for ever; it is held where it last was
  guard,         // a body is stepped more carefully, or normally again: `magnitude` is what was found
  dust,          // `count` grains leave the new surfaces of a finite-element body: `particles`
  parted,        // a joint of a body gave way at `point` to a force of `magnitude` [N]
  warning,       // something that the scene asks of a body may not hold: `message` says what
};

// What happened in a world. Ordered, numbered without gaps.
struct WorldEvent {
  std::uint64_t sequence = 0;  // from 1
  std::uint64_t step = 0;
  double time = 0;             // simulated [s]
  EventKind kind = EventKind::fracture;
  BodyId body = 0;
  Vec3 point = Vec3::Zero();   // where it makes sense, in W [m]
  double magnitude = 0;
  int count = 0;
  int fragments = 0;
  std::uint32_t epoch = 0;
  std::string message;         // one sentence for a log
  std::vector<DustParticle> particles;
};

std::string to_string(EventKind kind);

}  // namespace crumple::client
