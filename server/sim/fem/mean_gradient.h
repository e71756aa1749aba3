#pragma once

#include "common/types.h"

#include <cmath>
#include <span>

namespace crumple::sim::fem {

// F = sum x_a g_a^T of an element that averages over tets, from differences: sum g_a = 0. nodes, core: of its corners, core =
// -sqrt(V) g_a; x: of all nodes.
inline Mat3 mean_gradient(std::span<const int> nodes, std::span<const Vec3> core, double volume, std::span<const Vec3> x) {
  const Vec3& from = x[nodes[0]];
  Mat3 sum = Mat3::Zero();
  for (std::size_t c = 1; c < nodes.size(); ++c) sum += (x[nodes[c]] - from) * core[c].transpose();
  return sum * (-1 / std::sqrt(volume));
}

}  // namespace crumple::sim::fem
