#include "server/authoring/surface_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace crumple::authoring {
namespace {

Vec3 nearest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double length2 = d.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return a + s * d;
}

double box_distance2(const TriangleBvh::Node& box, const Vec3& p) {
  return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).squaredNorm();
}

}  // namespace

Vec3 nearest_point_on_triangle(const Vec3& p, const std::array<Vec3, 3>& corners) {
  const auto& [a, b, c] = corners;
  const Vec3 n = (b - a).cross(c - a);
  // Above the triangle's inside (left of all three edges) the foot of the perpendicular is nearest.
  if (n.squaredNorm() > 0 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
      n.dot((a - c).cross(p - c)) >= 0)
    return p - n * (n.dot(p - a) / n.squaredNorm());
  Vec3 best = nearest_point_on_segment(p, a, b);
  for (const Vec3& other : {nearest_point_on_segment(p, b, c), nearest_point_on_segment(p, c, a)})
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  return best;
}

SurfaceDistance::SurfaceDistance(const sim::SurfaceMesh& surface) : tree_(surface) { assert(!tree_.nodes.empty()); }

SurfaceDistance::Nearest SurfaceDistance::nearest(const Vec3& p) const {
  Nearest best{Vec3::Zero(), -1, std::numeric_limits<double>::infinity()};
  double best2 = best.distance;
  std::array<int, 64> stack{};
  int top = 1;
  while (top > 0) {
    const int id = stack[--top];
    const TriangleBvh::Node& node = tree_.nodes[id];
    if (box_distance2(node, p) >= best2) continue;
    if (!node.leaf()) {
      const bool left_first = box_distance2(tree_.nodes[id + 1], p) <= box_distance2(tree_.nodes[node.right], p);
      stack[top++] = left_first ? node.right : id + 1;
      stack[top++] = left_first ? id + 1 : node.right;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const Vec3 q = nearest_point_on_triangle(p, tree_.corners[k]);
      if (const double d2 = (q - p).squaredNorm(); d2 < best2) {
        best2 = d2;
        best = {q, tree_.triangle[k], 0};
      }
    }
  }
  best.distance = std::sqrt(best2);
  return best;
}

}  // namespace crumple::authoring
