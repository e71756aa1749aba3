#pragma once

#include "server/sim/example_based/example_rest.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::example_based {

// What a vertex remembers of impulses below beta (fatigue.h).
struct SiteMemory {
  int vertex;
  Vec3 impulse;  // [N s] in the asset's axes
};

// Everything about an example-based body's shape that a step changes; a snapshot copies this and nothing else. (Where
// the body is and how it moves belongs to the rigid room.)
struct ExampleState {
  WeightMatrix E;           // N x E example weights: entries in [0, 1], rows sum to 1, rest pose first
  WeightMatrix dE;          // N x E deformation accumulator: what is still to be applied
  std::vector<Vec3> x;      // N skinned positions in the asset's axes [m]; never re-centred, the rigid room does that
  std::vector<int> active;  // vertices whose row of dE is not zero, ascending
  double restitution = 0;   // C_r [-]

  std::vector<SiteMemory> fatigue;  // ascending by vertex

  // What the secondary goal has still to do (secondary_goal.h).
  std::vector<int> goal_rows;  // vertices that it looks at, ascending
  std::vector<Vec3> goal_x;    // of them: where they came to rest [m]
  std::int64_t goal_left = 0;  // rows to be looked at, over all passes
};

// Neither impulses nor the secondary goal have anything left to do.
inline bool is_at_rest(const ExampleState& state) { return state.active.empty() && state.goal_left == 0; }

// Undeformed: E = (1, 0, ..., 0) in every row, dE = 0, C_r = C_r^*.
ExampleState make_state(const ExampleRest& rest, const ExampleParameters& parameters);

}  // namespace crumple::sim::example_based
