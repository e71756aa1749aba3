#pragma once

#include "server/sim/islands/island_system.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace crumple::sim::islands {

// Where the solve of a body starts that is held and touches nothing: of all v + a v + b (v - v_before), v and v_before
// its velocities one and two steps back, the one that is nearest to the solution in the norm of A (FI). A body that swings in one mode is there
// already. It costs one product more than to start from v, and is never further away.
//
// With contact it would save iterations as well, but none of the time: what rows do changes from step to step. What may
// turn has few to save, and what the tolerance leaves (now closer to all that it may) would be seen in its spin: 1 % of
// the energy in 60 steps, from v a quarter of it. So every piece of the body must be held by three nodes or more.
class ProjectedStart {
 public:
  // Whether the island is one such body, and its velocities two steps back are known.
  bool applies(const CompositeIsland& island, std::span<const IslandBody> bodies);

  // x: the velocities before the step, prescribed ones in place, which they stay; becomes the start. r: becomes b - A x.
  void project(const IslandSystem& system, const IslandBody& body, const Eigen::VectorXd& b, const ThreadPool& pool,
               Eigen::VectorXd& x, Eigen::VectorXd& r);

 private:
  Eigen::VectorXd level_, A_level_, change_, A_change_;  // v and v - v_before, zero where prescribed
  std::vector<std::array<double, 3>> sums_;              // one a chunk
  std::vector<int> held_;                                // prescribed nodes, one a piece
};

}  // namespace crumple::sim::islands
