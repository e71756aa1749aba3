#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace crumple::sim {

std::vector<int> weld(std::span<const Vec3> points, double tolerance) {
  using Cell = std::array<std::int64_t, 3>;
  std::map<Cell, std::vector<int>> kept;  // points that are the first of their place
  const Vec3 origin = points.empty() ? Vec3::Zero() : points.front();
  double reach = 1e-300;
  for (const Vec3& p : points) reach = std::max(reach, (p - origin).cwiseAbs().maxCoeff());
  const double edge = std::max(tolerance, 1e-12 * reach);
  const auto cell_of = [&](const Vec3& p) {
    Cell cell;
    for (int a = 0; a < 3; ++a) cell[a] = static_cast<std::int64_t>(std::floor((p[a] - origin[a]) / edge));
    return cell;
  };
  std::vector<int> first;
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Cell own = cell_of(points[v]);
    int found = static_cast<int>(v);
    for (int k = 0; k < 27; ++k) {
      const auto at = kept.find({own[0] + k % 3 - 1, own[1] + k / 3 % 3 - 1, own[2] + k / 9 - 1});
      if (at == kept.end()) continue;
      for (const int other : at->second)
        if (other < found && (points[other] - points[v]).norm() <= tolerance) found = other;
    }
    if (found == static_cast<int>(v)) kept[own].push_back(found);
    first.push_back(found);
  }
  return first;
}

}  // namespace crumple::sim
