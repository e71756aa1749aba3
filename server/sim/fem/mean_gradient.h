#pragma once

#include "common/types.h"

#include <cmath>
#include <span>

namespace crumple::sim::fem {

// F = sum x_a g_a^T of element k of a group whose elements average over tets (MacroElements, PressurePatches), from differences:
// sum g_a = 0. x: of all nodes.
template <class Group>
Mat3 mean_gradient(const Group& group, int k, std::span<const Vec3> x) {
  const int begin = group.corner_start[k], end = group.corner_start[k + 1];
  const Vec3& from = x[group.nodes[begin]];
  Mat3 sum = Mat3::Zero();
  for (int c = begin + 1; c < end; ++c) sum += (x[group.nodes[c]] - from) * group.core[c].transpose();
  return sum * (-1 / std::sqrt(group.volume[k]));
}

}  // namespace crumple::sim::fem
