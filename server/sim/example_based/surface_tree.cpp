#include "server/sim/example_based/surface_tree.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

namespace crumple::sim::example_based {

Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  // Foot of the perpendicular, if it lies inside.
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double g11 = ab.dot(ab), g12 = ab.dot(ac), g22 = ac.dot(ac);
  const double det = g11 * g22 - g12 * g12;
  if (det > 1e-14 * g11 * g22) {
    const double r1 = ab.dot(ap), r2 = ac.dot(ap);
    const double s = (g22 * r1 - g12 * r2) / det, t = (g11 * r2 - g12 * r1) / det;
    if (s >= 0 && t >= 0 && s + t <= 1) return {1 - s - t, s, t};
  }
  // Else the nearest point of the three edges.
  const Vec3* corner[3] = {&a, &b, &c};
  double best = std::numeric_limits<double>::infinity();
  Vec3 weights = Vec3::UnitX();
  for (int k = 0; k < 3; ++k) {
    const Vec3 from = *corner[k], along = *corner[(k + 1) % 3] - from;
    const double length2 = along.squaredNorm();
    const double s = length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0;
    const double distance2 = (p - from - s * along).squaredNorm();
    if (distance2 < best) {
      best = distance2;
      weights.setZero();
      weights[k] = 1 - s;
      weights[(k + 1) % 3] = s;
    }
  }
  return weights;
}

SurfaceTree::SurfaceTree(std::span<const Vec3> x, std::span<const Triangle> triangles)
    : triangles_(triangles.begin(), triangles.end()), order_(triangles.size()) {
  assert(!triangles.empty());
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vec3> centroids;
  centroids.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles_) centroids.push_back((x[a] + x[b] + x[c]) / 3);
  build(centroids, 0, static_cast<int>(order_.size()));
}

// Halves at the median along the longest side of the centroids' box.
int SurfaceTree::build(std::span<const Vec3> centroids, int first, int count) {
  const int node = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  nodes_[node].first = first;
  nodes_[node].count = count;
  if (count <= kLeaf) return node;
  Eigen::AlignedBox3d box;
  for (int k = first; k < first + count; ++k) box.extend(centroids[order_[k]]);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto begin = order_.begin() + first, middle = begin + count / 2;
  std::nth_element(begin, middle, begin + count, [&](int a, int b) {
    return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
  });
  const int left = build(centroids, first, count / 2);
  const int right = build(centroids, first + count / 2, count - count / 2);
  nodes_[node].left = left;
  nodes_[node].right = right;
  return node;
}

void SurfaceTree::refit(std::span<const Vec3> x, Boxes& boxes) const {
  boxes.resize(nodes_.size());
  for (int n = static_cast<int>(nodes_.size()) - 1; n >= 0; --n) {  // children come after their parents
    const Node& node = nodes_[n];
    boxes[n].setEmpty();
    if (node.left >= 0) {
      boxes[n] = boxes[node.left].merged(boxes[node.right]);
    } else {
      for (int k = node.first; k < node.first + node.count; ++k)
        for (int i : triangles_[order_[k]]) boxes[n].extend(x[i]);
    }
  }
}

// Visits the triangles of every leaf whose box is not farther than `best`, which `visit` lowers on the way.
template <class Visit>
void SurfaceTree::descend(int n, const Vec3& p, const Boxes& boxes, const double& best, const Visit& visit) const {
  const Node& node = nodes_[n];
  if (boxes[n].squaredExteriorDistance(p) > best) return;
  if (node.left < 0) {
    for (int k = node.first; k < node.first + node.count; ++k) visit(order_[k]);
    return;
  }
  const bool left_first = boxes[node.left].squaredExteriorDistance(p) <= boxes[node.right].squaredExteriorDistance(p);
  descend(left_first ? node.left : node.right, p, boxes, best, visit);
  descend(left_first ? node.right : node.left, p, boxes, best, visit);
}

SurfacePoint SurfaceTree::nearest(const Vec3& p, std::span<const Vec3> x, const Boxes& boxes) const {
  SurfacePoint found;
  found.distance2 = std::numeric_limits<double>::infinity();
  descend(0, p, boxes, found.distance2, [&](int triangle) {
    const auto& [a, b, c] = triangles_[triangle];
    const Vec3 w = nearest_on_triangle(p, x[a], x[b], x[c]);
    const double distance2 = (p - w[0] * x[a] - w[1] * x[b] - w[2] * x[c]).squaredNorm();
    if (distance2 < found.distance2 || (distance2 == found.distance2 && triangle < found.triangle))
      found = {triangle, w, distance2};
  });
  return found;
}

int SurfaceTree::nearest_vertex(const Vec3& p, std::span<const Vec3> x, const Boxes& boxes) const {
  int found = -1;
  double best = std::numeric_limits<double>::infinity();
  descend(0, p, boxes, best, [&](int triangle) {
    for (int i : triangles_[triangle]) {
      const double distance2 = (p - x[i]).squaredNorm();
      if (distance2 < best || (distance2 == best && i < found)) {
        best = distance2;
        found = i;
      }
    }
  });
  return found;
}

}  // namespace crumple::sim::example_based
