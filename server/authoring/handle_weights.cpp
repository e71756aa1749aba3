#include "server/authoring/handle_weights.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace crumple::authoring {
namespace {

double mean_nearest_distance(std::span<const Vec3> bones) {
  double sum = 0;
  for (size_t a = 0; a < bones.size(); ++a) {
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t b = 0; b < bones.size(); ++b)
      if (b != a) nearest = std::min(nearest, (bones[a] - bones[b]).norm());
    sum += nearest;
  }
  return sum / static_cast<double>(bones.size());
}

}  // namespace

Eigen::MatrixXd handle_weights(std::span<const Vec3> vertices, std::span<const Vec3> bones) {
  assert(!bones.empty());
  const int N = static_cast<int>(vertices.size()), B = static_cast<int>(bones.size());
  const double s = 0.55 * mean_nearest_distance(bones);
  // One bone, or all in one place: they share alike.
  if (!(s > 0) || !std::isfinite(s)) return Eigen::MatrixXd::Constant(N, B, 1.0 / B);
  Eigen::MatrixXd W(N, B);
  for (int i = 0; i < N; ++i) {
    for (int b = 0; b < B; ++b) W(i, b) = (vertices[i] - bones[b]).squaredNorm();
    // Relative to the nearest bone, so that no row vanishes far away from all.
    W.row(i) = ((W.row(i).array() - W.row(i).minCoeff()) / (-2 * s * s)).exp();
    W.row(i) /= W.row(i).sum();
  }
  return W;
}

}  // namespace crumple::authoring
