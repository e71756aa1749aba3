#pragma once

#include "server/sim/example_based/example_state.h"
#include "server/sim/parallel_for.h"

#include <span>
#include <vector>

// Volume as a goal where the examples allow it: "we make no effort to preserve the volume of our objects. Even if the
// artist's examples maintain volume, interpolations of the examples may not. It would be interesting to consider volume
// preservation as a secondary goal when the artist's examples form an overcomplete basis" (Jones et al. 2016, section 6).
//
// Ours: in each step that changes weights, one more change of them, phi_i d on row i: spread as the step's own change was
// (phi_i its length), with one direction d for the body. d is the steepest that gives back volume,
//   H = sum_i phi_i J_i^T (dV / dx_i),
// among those that keep the weights' sum and do not undo the dent: sum_i phi_i (J_i d) . u_i = 0, u_i what the step moved
// vertex i by. Its length makes up for all that V is off its rest value, but is at most kMostBulge: a step bulges no more
// than it dents, so that a body at rest does not change, and examples that cannot give volume are not strained.
namespace crumple::sim::example_based {

inline constexpr double kMostBulge = 2;  // |d| [-]

// Rows of a state before a step changed them.
struct RowsBefore {
  std::vector<int> vertices;  // ascending
  std::vector<double> E;      // rows of them, one after the other
  std::vector<Vec3> x;        // [m]

  void keep(const ExampleState& state, std::span<const int> which);
};

// Corrects state.E on the rows of `before`, which a step has changed and state.x shows, towards the volume of the rest pose.
// Returns whether it did; x is then for the caller.
bool give_back_volume(const ExampleRest& rest, const RowsBefore& before, const ThreadPool& pool, ExampleState& state);

}  // namespace crumple::sim::example_based
