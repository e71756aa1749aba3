#include "server/sim/rigid/collision_triangles.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>

namespace crumple::sim {
namespace {

// Ids of positions: vertices at exactly the same place share one, as in meshes split along texture seams.
std::vector<int> weld(const std::vector<Vec3>& vertices) {
  std::map<std::tuple<double, double, double>, int> ids;
  std::vector<int> welded(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& p = vertices[i];
    welded[i] = ids.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(i)).first->second;
  }
  return welded;
}

}  // namespace

std::vector<Triangle> sound_triangles(const SurfaceMesh& mesh) {
  const std::vector<int> welded = weld(mesh.vertices);
  std::set<Triangle> seen;
  std::vector<Triangle> sound;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (!((b - a).cross(c - a).norm() > 1e-6 * longest)) continue;  // not a number falls here, too
    Triangle key{welded[t[0]], welded[t[1]], welded[t[2]]};
    std::ranges::sort(key);
    if (seen.insert(key).second) sound.push_back(t);
  }
  return sound;
}

EdgeShape::EdgeShape(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  const std::vector<int> welded = weld(vertices);
  struct Side {
    int triangle, opposite;  // the vertex of the triangle that is not on the edge
  };
  std::map<std::pair<int, int>, std::vector<Side>> edges;
  const auto edge_of = [&](const Triangle& t, int k) { return std::minmax(welded[t[k]], welded[t[(k + 1) % 3]]); };
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    for (int k = 0; k < 3; ++k) edges[edge_of(triangles[t], k)].push_back({t, triangles[t][(k + 2) % 3]});
  }

  constexpr double kFlat = 0.01;  // sine of an angle between faces that counts as none
  triangles_.resize(triangles.size());
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    Face& face = triangles_[t];
    for (int k = 0; k < 3; ++k) face.corner[k] = vertices[triangles[t][k]];
    face.normal = (face.corner[1] - face.corner[0]).cross(face.corner[2] - face.corner[0]).normalized();
    for (int k = 0; k < 3; ++k) {
      face.ridge[0][k] = face.ridge[1][k] = true;
      for (const Side& side : edges[edge_of(triangles[t], k)]) {
        if (side.triangle == t) continue;
        const Vec3 across = vertices[side.opposite] - face.corner[k];
        const Vec3 along = (face.corner[(k + 1) % 3] - face.corner[k]).normalized();
        const double width = (across - across.dot(along) * along).norm();
        const double rise = across.dot(face.normal);
        face.ridge[0][k] &= rise < -kFlat * width;
        face.ridge[1][k] &= rise > kFlat * width;
      }
    }
  }
}

bool EdgeShape::on_ridge(int t, const Vec3& p, const Vec3& n) const {
  const Face& face = triangles_[t];
  const bool back = n.dot(face.normal) < 0;
  for (int k = 0; k < 3; ++k) {
    if (!face.ridge[back][k]) continue;
    const Vec3 edge = face.corner[(k + 1) % 3] - face.corner[k];
    const Vec3 inward = face.normal.cross(edge).normalized();
    const double height = (face.corner[(k + 2) % 3] - face.corner[k]).dot(inward);
    if ((p - face.corner[k]).dot(inward) < 1e-3 * height) return true;
  }
  return false;
}

}  // namespace crumple::sim
