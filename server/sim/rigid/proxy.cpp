#include "server/sim/rigid/proxy.h"

#include <cmath>
#include <numbers>

#include "server/sim/rigid/convex_hull.h"
#include "server/sim/rigid/primitive_meshes.h"

namespace crumple::sim {
namespace {

constexpr int kProxySides = 16;

SurfaceMesh scaled(SurfaceMesh mesh, const Vec3& factors) {
  for (Vec3& v : mesh.vertices) v = v.cwiseProduct(factors);
  return mesh;
}

// A star-shaped closed surface for a fan of tets about `centre`; nullopt: not possible; no triangle: none needed.
struct ProxySurface {
  std::optional<SurfaceMesh> operator()(const Box& box) const { return box_surface(box.half_extents); }
  std::optional<SurfaceMesh> operator()(const Sphere& sphere) const {
    const SurfaceMesh unit = icosphere(1, 1);
    const double factor = std::cbrt(4 * std::numbers::pi / 3 / enclosed_volume(unit));
    return scaled(unit, Vec3::Constant(factor * sphere.radius));
  }
  std::optional<SurfaceMesh> operator()(const Cylinder& c) const {
    const double angle = 2 * std::numbers::pi / kProxySides;
    return cylinder_surface(c.radius * std::sqrt(angle / std::sin(angle)), c.half_length, kProxySides);
  }
  std::optional<SurfaceMesh> operator()(const Plane&) const { return SurfaceMesh{}; }
  std::optional<SurfaceMesh> operator()(const ConvexHull& hull) const {
    Result<SurfaceMesh> surface = convex_hull(hull.points, "");
    if (!surface) return std::nullopt;
    return *std::move(surface);
  }
  std::optional<SurfaceMesh> operator()(const TriangleShape&) const { return std::nullopt; }
};

void append_fan(const SurfaceMesh& surface, const Pose& X_BS, TetMesh& tets) {
  if (surface.triangles.empty()) return;
  const int first = tets.node_count();
  const int centre = first + static_cast<int>(surface.vertices.size());
  Vec3 mean = Vec3::Zero();
  for (const Vec3& v : surface.vertices) {
    tets.X.push_back(X_BS * v);
    mean += v;
  }
  tets.X.push_back(X_BS * (mean / static_cast<double>(surface.vertices.size())));
  for (const auto& [a, b, c] : surface.triangles) tets.tets.push_back({centre, first + a, first + b, first + c});
}

SurfaceMesh plane_grid(const Plane& plane, double reach) {
  constexpr int kCells = 10;
  const double cell = 2 * reach / kCells;
  const Vec3 n = plane.normal.normalized();
  const Vec3 u = n.unitOrthogonal(), v = n.cross(u);
  const Vec3 centre = plane.offset / plane.normal.norm() * n;
  SurfaceMesh mesh;
  for (int j = 0; j <= kCells; ++j) {
    for (int i = 0; i <= kCells; ++i) {
      mesh.vertices.push_back(centre + cell * ((i - kCells / 2) * u + (j - kCells / 2) * v));
    }
  }
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const int a = j * (kCells + 1) + i, b = a + 1, c = a + kCells + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

struct DrawnSurface {
  double plane_reach;  // [m]

  SurfaceMesh operator()(const Box& box) const { return box_surface(box.half_extents); }
  SurfaceMesh operator()(const Sphere& sphere) const { return icosphere(sphere.radius, 3); }
  SurfaceMesh operator()(const Cylinder& c) const { return cylinder_surface(c.radius, c.half_length, 32); }
  SurfaceMesh operator()(const Plane& plane) const { return plane_grid(plane, plane_reach); }
  SurfaceMesh operator()(const ConvexHull& hull) const { return convex_hull(hull.points, "").value_or(SurfaceMesh{}); }
  SurfaceMesh operator()(const TriangleShape& triangles) const { return triangles.mesh; }
};

}  // namespace

std::optional<TetMesh> proxy_tets(const std::vector<PlacedShape>& shapes) {
  TetMesh tets;
  for (const PlacedShape& placed : shapes) {
    const std::optional<SurfaceMesh> surface = std::visit(ProxySurface{}, placed.shape);
    if (!surface) return std::nullopt;
    append_fan(*surface, placed.pose, tets);
  }
  return tets;
}

SurfaceMesh draw_mesh(const std::vector<PlacedShape>& shapes, double plane_reach) {
  SurfaceMesh mesh;
  for (const PlacedShape& placed : shapes) {
    const SurfaceMesh part = std::visit(DrawnSurface{plane_reach}, placed.shape);
    const int first = static_cast<int>(mesh.vertices.size());
    for (const Vec3& v : part.vertices) mesh.vertices.push_back(placed.pose * v);
    for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  }
  return mesh;
}

}  // namespace crumple::sim
