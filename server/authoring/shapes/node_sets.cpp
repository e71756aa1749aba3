#include "server/authoring/shapes/node_sets.h"

#include <set>

namespace crumple::authoring {

std::vector<int> nodes_in_box(std::span<const Vec3> X, const Vec3& lower, const Vec3& upper) {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(X.size()); ++i)
    if ((X[i].array() >= lower.array()).all() && (X[i].array() <= upper.array()).all()) out.push_back(i);
  return out;
}

std::vector<int> nodes_on_side(std::span<const Vec3> X, Side side) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : X) box.extend(p);
  if (X.empty()) return {};
  const int axis = static_cast<int>(side) / 2;
  const bool max = static_cast<int>(side) % 2 == 1;
  const double tolerance = 1e-9 * box.diagonal().norm();
  Vec3 lower = box.min(), upper = box.max();
  (max ? lower : upper)[axis] = max ? upper[axis] - tolerance : lower[axis] + tolerance;
  return nodes_in_box(X, lower, upper);
}

std::vector<int> nodes_on_sides(std::span<const Vec3> X, std::span<const Side> sides) {
  std::set<int> out;
  for (const Side side : sides)
    for (const int node : nodes_on_side(X, side)) out.insert(node);
  return {out.begin(), out.end()};
}

}  // namespace crumple::authoring
