#include "server/sim/rigid/primitive_meshes.h"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace crumple::sim {

SurfaceMesh box_surface(const Vec3& half_extents) {
  SurfaceMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back(half_extents.cwiseProduct(Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  constexpr int quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

SurfaceMesh icosphere(double radius, int levels) {
  const double g = std::numbers::phi;
  SurfaceMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto split = [&](int a, int b) {
      const auto [it, is_new] = middle.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return it->second;
    };
    for (Vec3& v : mesh.vertices) v.normalize();
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = split(a, b), bc = split(b, c), ca = split(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& v : mesh.vertices) v = radius * v.normalized();
  return mesh;
}

SurfaceMesh cylinder_surface(double radius, double half_length, int sides) {
  SurfaceMesh mesh;
  for (int i = 0; i < sides; ++i) {  // 2i at the bottom, 2i+1 on top
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double y : {-half_length, half_length}) {
      mesh.vertices.push_back({radius * std::cos(angle), y, -radius * std::sin(angle)});
    }
  }
  const int bottom = 2 * sides, top = bottom + 1;
  mesh.vertices.push_back({0, -half_length, 0});
  mesh.vertices.push_back({0, half_length, 0});
  for (int i = 0; i < sides; ++i) {
    const int a = 2 * i, b = 2 * ((i + 1) % sides);
    mesh.triangles.insert(mesh.triangles.end(),
                          {{a, b, b + 1}, {a, b + 1, a + 1}, {bottom, b, a}, {top, a + 1, b + 1}});
  }
  return mesh;
}

double enclosed_volume(const SurfaceMesh& mesh) {
  double volume = 0;
  const Vec3 origin = mesh.vertices.empty() ? Vec3::Zero() : mesh.vertices[0];
  for (const auto& [a, b, c] : mesh.triangles) {
    volume += (mesh.vertices[a] - origin).dot((mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin)) / 6;
  }
  return volume;
}

}  // namespace crumple::sim
