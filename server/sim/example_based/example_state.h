#pragma once

#include "server/sim/example_based/example_rest.h"

#include <vector>

namespace crumple::sim::example_based {

// Everything about an example-based body's shape that a step changes; a snapshot copies this and nothing else. (Where
// the body is and how it moves belongs to the rigid room.)
struct ExampleState {
  WeightMatrix E;           // N x E example weights: entries in [0, 1], rows sum to 1, rest pose first
  WeightMatrix dE;          // N x E deformation accumulator: what is still to be applied
  std::vector<Vec3> x;      // N skinned positions in the asset's axes [m]; never re-centred, the rigid room does that
  std::vector<int> active;  // vertices whose row of dE is not zero, ascending
  double restitution = 0;   // C_r [-]
};

// Undeformed: E = (1, 0, ..., 0) in every row, dE = 0, C_r = C_r^*.
ExampleState make_state(const ExampleRest& rest, const ExampleParameters& parameters);

}  // namespace crumple::sim::example_based
