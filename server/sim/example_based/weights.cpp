#include "server/sim/example_based/weights.h"

#include <cassert>

namespace crumple::sim::example_based {

Eigen::MatrixXd distance_weights(std::span<const Vec3> vertices, std::span<const Vec3> bones) {
  assert(!bones.empty());
  const int n = static_cast<int>(vertices.size()), B = static_cast<int>(bones.size());
  Eigen::MatrixXd W(n, B);
  Eigen::VectorXd distance2(B);
  for (int i = 0; i < n; ++i) {
    for (int b = 0; b < B; ++b) distance2[b] = (vertices[i] - bones[b]).squaredNorm();
    // Relative to the nearest bone nothing overflows, at any scale.
    const double nearest2 = distance2.minCoeff();
    for (int b = 0; b < B; ++b) {
      const double ratio = distance2[b] > nearest2 ? nearest2 / distance2[b] : 1;
      W(i, b) = ratio * ratio;
    }
    W.row(i) /= W.row(i).sum();
  }
  return W;
}

}  // namespace crumple::sim::example_based
