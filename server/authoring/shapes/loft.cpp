#include "server/authoring/shapes/loft.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

// cos or sin of a superellipse.
double rounded(double c, double power) { return std::copysign(std::pow(std::abs(c), 2 / power), c); }

}  // namespace

sim::SurfaceMesh loft_surface(const Loft& loft) {
  const int rings = static_cast<int>(loft.stations.size()), sides = loft.sides;
  assert(rings >= 2 && sides >= 3 && loft.axis >= 0 && loft.axis < 3);
  // u, v and the axis are right-handed
  const Vec3 u = Vec3::Unit((loft.axis + 1) % 3), v = Vec3::Unit((loft.axis + 2) % 3);
  sim::SurfaceMesh mesh;
  for (const LoftStation& station : loft.stations) {
    const double along_u = (loft.axis == 2 ? station.width : station.height) / 2;
    const double along_v = (loft.axis == 2 ? station.height : station.width) / 2;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5) / sides;
      mesh.vertices.push_back(station.centre + along_u * rounded(std::cos(angle), loft.power) * u +
                              along_v * rounded(std::sin(angle), loft.power) * v);
    }
  }
  const int first = static_cast<int>(mesh.vertices.size()), last = first + 1;
  mesh.vertices.push_back(loft.stations.front().centre);
  mesh.vertices.push_back(loft.stations.back().centre);
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides, end = (rings - 1) * sides;
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sides + k, b = r * sides + next;
      mesh.triangles.push_back({a, b, a + sides});
      mesh.triangles.push_back({b, b + sides, a + sides});
    }
    mesh.triangles.push_back({first, next, k});
    mesh.triangles.push_back({last, end + k, end + next});
  }
  return mesh;
}

}  // namespace crumple::authoring
