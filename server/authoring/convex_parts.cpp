#include "server/authoring/convex_parts.h"

#include <Eigen/Eigenvalues>

namespace crumple::authoring {
namespace {

bool has_volume(const std::vector<Vec3>& X, const std::vector<int>& ids) {
  if (ids.size() < 4) return false;
  Vec3 mean = Vec3::Zero();
  for (const int id : ids) mean += X[id] / static_cast<double>(ids.size());
  Mat3 spread = Mat3::Zero();
  for (const int id : ids) spread += (X[id] - mean) * (X[id] - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > 1e-6 * eigen.eigenvalues()[2];
}

}  // namespace

std::vector<int> hull_part_in_box(const std::vector<Vec3>& X, const std::vector<int>& surface, const Vec3& lower,
                                  const Vec3& upper) {
  std::vector<int> ids;
  for (const int id : surface)
    if ((X[id].array() >= lower.array()).all() && (X[id].array() <= upper.array()).all()) ids.push_back(id);
  return has_volume(X, ids) ? ids : std::vector<int>{};
}

std::vector<std::vector<int>> hull_parts_along_longest_axis(const std::vector<Vec3>& X, const std::vector<int>& surface,
                                                            int slabs, double overlap) {
  Eigen::AlignedBox3d box;
  for (const int id : surface) box.extend(X[id]);
  int axis = 0;
  const double slab = box.sizes().maxCoeff(&axis) / slabs;
  std::vector<std::vector<int>> parts;
  for (int k = 0; k < slabs; ++k) {
    Vec3 lower = box.min(), upper = box.max();
    if (k > 0) lower[axis] = box.min()[axis] + k * slab - overlap;
    if (k + 1 < slabs) upper[axis] = box.min()[axis] + (k + 1) * slab + overlap;
    if (auto part = hull_part_in_box(X, surface, lower, upper); !part.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace crumple::authoring
