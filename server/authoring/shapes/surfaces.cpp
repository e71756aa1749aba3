#include "server/authoring/shapes/surfaces.h"

#include <cassert>
#include <cmath>
#include <map>
#include <numbers>

namespace crumple::authoring {
namespace {

sim::SurfaceMesh icosahedron(double radius) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  sim::SurfaceMesh out;
  for (const auto& [a, b] : {std::pair(-1.0, g), {1.0, g}, {-1.0, -g}, {1.0, -g}}) out.vertices.push_back({a, b, 0});
  for (const auto& [a, b] : {std::pair(-1.0, g), {1.0, g}, {-1.0, -g}, {1.0, -g}}) out.vertices.push_back({0, a, b});
  for (const auto& [a, b] : {std::pair(-1.0, g), {1.0, g}, {-1.0, -g}, {1.0, -g}}) out.vertices.push_back({b, 0, a});
  for (Vec3& v : out.vertices) v *= radius / v.norm();
  out.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return out;
}

sim::SurfaceMesh refined(const sim::SurfaceMesh& coarse, double radius) {
  sim::SurfaceMesh out{coarse.vertices, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(out.vertices.size()));
    if (is_new) {
      const Vec3 sum = out.vertices[a] + out.vertices[b];
      out.vertices.push_back(sum * (radius / sum.norm()));
    }
    return at->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& t : {Triangle{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}}) out.triangles.push_back(t);
  }
  return out;
}

}  // namespace

sim::SurfaceMesh box_surface(const Vec3& half_extents) {
  assert(half_extents.minCoeff() > 0);
  sim::SurfaceMesh out;
  for (int k = 0; k < 8; ++k)
    out.vertices.push_back(half_extents.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  out.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return out;
}

sim::SurfaceMesh icosphere(double radius, int levels) {
  assert(radius > 0 && levels >= 0 && levels <= 8);
  sim::SurfaceMesh out = icosahedron(radius);
  for (int k = 0; k < levels; ++k) out = refined(out, radius);
  return out;
}

sim::SurfaceMesh cylinder_surface(double radius, double half_length, int segments) {
  const Eigen::Vector2d profile[] = {
      {0, -half_length}, {radius, -half_length}, {radius, half_length}, {0, half_length}};
  return lathe(profile, segments);
}

sim::SurfaceMesh lathe(std::span<const Eigen::Vector2d> profile, int segments) {
  assert(profile.size() >= 3 && segments >= 3 && profile.front().x() == 0 && profile.back().x() == 0);
  const int rings = static_cast<int>(profile.size()) - 2;
  sim::SurfaceMesh out;
  for (int ring = 1; ring <= rings; ++ring)
    for (int s = 0; s < segments; ++s) {
      assert(profile[ring].x() > 0);
      const double angle = 2 * std::numbers::pi * s / segments;  // counter-clockwise seen from +y
      out.vertices.push_back(
          {profile[ring].x() * std::cos(angle), profile[ring].y(), -profile[ring].x() * std::sin(angle)});
    }
  const int lower = rings * segments, upper = lower + 1;
  out.vertices.push_back({0, profile.front().y(), 0});
  out.vertices.push_back({0, profile.back().y(), 0});
  const auto at = [&](int ring, int s) { return ring * segments + s % segments; };
  for (int s = 0; s < segments; ++s) out.triangles.push_back({lower, at(0, s + 1), at(0, s)});
  for (int ring = 0; ring + 1 < rings; ++ring)
    for (int s = 0; s < segments; ++s) {
      out.triangles.push_back({at(ring, s), at(ring, s + 1), at(ring + 1, s + 1)});
      out.triangles.push_back({at(ring, s), at(ring + 1, s + 1), at(ring + 1, s)});
    }
  for (int s = 0; s < segments; ++s) out.triangles.push_back({upper, at(rings - 1, s), at(rings - 1, s + 1)});
  return out;
}

void append(sim::SurfaceMesh& surface, const sim::SurfaceMesh& part, const Pose& pose) {
  const int first = static_cast<int>(surface.vertices.size());
  for (const Vec3& v : part.vertices) surface.vertices.push_back(pose * v);
  for (const auto& [a, b, c] : part.triangles) surface.triangles.push_back({first + a, first + b, first + c});
}

double enclosed_volume(const sim::SurfaceMesh& surface) {
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles)
    volume += surface.vertices[a].dot(surface.vertices[b].cross(surface.vertices[c])) / 6;
  return volume;
}

}  // namespace crumple::authoring
