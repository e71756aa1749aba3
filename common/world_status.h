#pragma once

#include "common/frame.h"
#include "common/types.h"

#include <cstdint>
#include <string>
#include <vector>

// What a server tells about a world besides its frames. Plain values that know no transport.
namespace crumple {

using WorldId = std::uint64_t;  // given by the server, from 1, never used twice

enum class WorldState : std::uint8_t { paused = 1, playing, stepping, failed };

struct WorldStatus {
  WorldId id = 0;
  std::string name;
  WorldState state = WorldState::paused;
  std::uint64_t step = 0;
  double time = 0;              // simulated [s]
  double dt = 0;                // [s]
  double real_time_factor = 0;  // simulated over wall time while playing, smoothed over 1 s; else 0
  double step_ms = 0;           // wall time of the last step
  double dropped_seconds = 0;   // wall time that the clock gave up since play
  int bodies = 0;
  int asleep = 0;               // bodies that are not stepped until something wakes them
  int viewers = 0;
  std::string failure;          // of a failed world
};

struct BodyStatus {
  BodyId id = 0;
  std::string name;
  BodyModel model = BodyModel::rigid;
  Pose pose;                     // X_WB; finite-element bodies: their mean position
  Vec3 velocity = Vec3::Zero();  // of the centre of mass [m/s]
  bool asleep = false;
};

// A world looked at between two steps: all of the same step.
struct WorldInfo {
  WorldStatus status;
  std::vector<BodyStatus> bodies;  // on request
  std::uint64_t state_hash = 0;    // on request
};

// Outcome of N steps in lockstep; counts are sums over the steps.
struct StepSummary {
  std::uint64_t step = 0;   // steps taken since the world began
  double time = 0;          // simulated [s]
  std::uint32_t steps = 0;  // taken by this call; fewer than asked if a pause ended it
  double wall_ms = 0;
  std::uint64_t contacts = 0, solver_iterations = 0, capped_solves = 0, splits = 0, plastic_impulses = 0;
  double worst_residual = 0;     // relative
  double worst_penetration = 0;  // [m]
  std::uint64_t state_hash = 0;  // on request
};

// Events that a reader was too slow for: numbers first to last, both lost.
struct EventGap {
  std::uint64_t first = 0, last = 0;
};

}  // namespace crumple
