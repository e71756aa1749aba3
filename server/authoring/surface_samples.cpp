#include "server/authoring/surface_samples.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

namespace crumple::authoring {

SurfaceSamples::SurfaceSamples(const sim::SurfaceMesh& surface, double spacing)
    : vertices_(static_cast<int>(surface.vertices.size())) {
  assert(spacing > 0);
  constexpr double kMostParts = 200;  // of an edge
  const auto parts = [&](int a, int b) {
    const double length = (surface.vertices[a] - surface.vertices[b]).norm();
    return static_cast<int>(std::clamp(std::ceil(length / spacing), 1.0, kMostParts));
  };
  std::set<std::pair<int, int>> seen;
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3], n = parts(a, b);
      if (!seen.insert(std::minmax(a, b)).second) continue;
      for (int i = 1; i < n; ++i) samples_.push_back({{a, b, a}, Vec3(1 - double(i) / n, double(i) / n, 0)});
    }
  for (const Triangle& t : surface.triangles) {
    const int n = std::max({parts(t[0], t[1]), parts(t[1], t[2]), parts(t[2], t[0])});
    for (int i = 1; i < n; ++i)
      for (int j = 1; i + j < n; ++j) samples_.push_back({t, Vec3(n - i - j, i, j) / n});
  }
}

std::vector<Vec3> SurfaceSamples::at(std::span<const Vec3> vertices) const {
  assert(static_cast<int>(vertices.size()) == vertices_);
  std::vector<Vec3> out(vertices.begin(), vertices.end());
  for (const auto& [corners, share] : samples_)
    out.emplace_back(share[0] * vertices[corners[0]] + share[1] * vertices[corners[1]] +
                     share[2] * vertices[corners[2]]);
  return out;
}

}  // namespace crumple::authoring
