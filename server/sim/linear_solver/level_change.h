#pragma once

#include "server/sim/linear_solver/level_transfer.h"

#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// A level of a body, as it was or as it is.
struct LevelView {
  LevelGraph fine;
  const LevelTransfer& transfer;
};

// What of a level is as it was before a body's topology changed, points being numbered anew.
struct LevelChange {
  std::vector<int> fine_before;    // of each fine point which one it was, -1: none; ascending but for those
  std::vector<int> coarse_before;  // likewise of coarse points
  std::vector<int> coarse_after;   // of each coarse point of before which one it is
  // Of each coarse point: the fine points that it moves, their rows, and the transfers of all that these touch are what they were. So
  // is then its row of the Galerkin product.
  std::vector<char> same;
};

// Matches points of before by where they were: -1 where there is none. Right for nodes that were added at the end and nodes that
// left; where it is not, more is found to have changed than has.
std::vector<int> match_points(std::span<const Vec3> before, std::span<const Vec3> now);

LevelChange level_change(const LevelView& before, const LevelView& now, std::vector<int> fine_before);

}  // namespace crumple::sim::linear_solver
