#include "server/sim/rigid/hull_faces.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace crumple::sim {
namespace {

constexpr double kFlat = 0.999;  // cosine

// Triangle across each edge: edge k of triangle t runs from its corner k to corner k + 1.
std::vector<std::array<int, 3>> neighbours(const std::vector<Triangle>& triangles) {
  struct Edge {
    int low, high, triangle, side;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, k});
    }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::array{e.low, e.high, e.triangle}; });
  std::vector<std::array<int, 3>> across(triangles.size(), {-1, -1, -1});
  for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
    const Edge &a = edges[k], &b = edges[k + 1];
    if (a.low != b.low || a.high != b.high) continue;
    across[a.triangle][a.side] = b.triangle;
    across[b.triangle][b.side] = a.triangle;
  }
  return across;
}

}  // namespace

std::vector<HullFace> hull_faces(const SurfaceMesh& hull) {
  const int count = static_cast<int>(hull.triangles.size());
  std::vector<Vec3> area(count);
  for (int t = 0; t < count; ++t) {
    const auto& [a, b, c] = hull.triangles[t];
    area[t] = (hull.vertices[b] - hull.vertices[a]).cross(hull.vertices[c] - hull.vertices[a]);
  }
  const std::vector<std::array<int, 3>> across = neighbours(hull.triangles);
  std::vector<int> by_size(count);
  std::iota(by_size.begin(), by_size.end(), 0);
  std::ranges::stable_sort(by_size, std::greater<>(), [&](int t) { return area[t].squaredNorm(); });

  std::vector<int> face_of(count, -1), group, next(hull.vertices.size(), -1);
  std::vector<HullFace> faces;
  for (const int seed : by_size) {
    if (face_of[seed] >= 0 || !(area[seed].norm() > 0)) continue;
    const int id = static_cast<int>(faces.size());
    HullFace face{.normal = area[seed].normalized(), .offset = -std::numeric_limits<double>::infinity()};
    group.assign(1, seed);
    face_of[seed] = id;
    for (std::size_t g = 0; g < group.size(); ++g)
      for (const int t : across[group[g]]) {
        if (t < 0 || face_of[t] >= 0 || !(face.normal.dot(area[t]) >= kFlat * area[t].norm())) continue;
        face_of[t] = id;
        group.push_back(t);
      }
    // The rim: edges that no other triangle of the face has. Where it meets itself in a vertex, one loop of it is kept.
    int start = -1, rim = 0;
    for (const int t : group)
      for (int k = 0; k < 3; ++k) {
        if (across[t][k] >= 0 && face_of[across[t][k]] == id) continue;
        start = hull.triangles[t][k];
        next[start] = hull.triangles[t][(k + 1) % 3];
        ++rim;
      }
    for (int corner = start, k = 0; k < rim && (k == 0 || corner != start); ++k, corner = next[corner]) {
      face.corners.push_back(corner);
      face.offset = std::max(face.offset, face.normal.dot(hull.vertices[corner]));
    }
    if (face.corners.size() >= 3) faces.push_back(std::move(face));
  }
  return faces;
}

}  // namespace crumple::sim
