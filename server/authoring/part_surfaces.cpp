#include "server/authoring/part_surfaces.h"

#include "server/authoring/polygon_triangles.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <limits>

namespace crumple::authoring {
namespace {

// Of several parts, that whose tets are nearest to the mean of points.
std::size_t nearest_part(const std::vector<const sim::TetMesh*>& meshes, const std::vector<Vec3>& points) {
  if (meshes.size() == 1) return 0;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  std::vector<double> distance;
  for (const sim::TetMesh* mesh : meshes) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int t = 0; t < mesh->tet_count(); ++t)
      nearest = std::min(nearest, sim::squared_distance(sim::rest_corners(*mesh, t), mean));
    distance.push_back(nearest);
  }
  return static_cast<std::size_t>(std::ranges::min_element(distance) - distance.begin());
}

sim::SurfaceMesh surface_of_polygons(const std::vector<Polygon>& polygons) {
  std::vector<Vec3> points;
  for (const Polygon& polygon : polygons) points.insert(points.end(), polygon.begin(), polygon.end());
  const std::vector<int> first = sim::weld(points, 0);
  sim::SurfaceMesh out;
  std::vector<int> id(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    const bool fresh = first[p] == static_cast<int>(p);
    id[p] = fresh ? static_cast<int>(out.vertices.size()) : id[first[p]];
    if (fresh) out.vertices.push_back(points[p]);
  }
  std::size_t at = 0;
  for (const Polygon& polygon : polygons) {
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
      const Triangle t{id[at], id[at + k], id[at + k + 1]};
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) out.triangles.push_back(t);
    }
    at += polygon.size();
  }
  return out;
}

}  // namespace

PartSurfaces::PartSurfaces(const sim::SurfaceMesh& render) : render_(render) {
  if (auto solid = polyhedron_of(render)) closed_ = std::move(*solid);
}

std::vector<sim::SurfaceMesh> PartSurfaces::cut(const SplinterCell& cell, const CellParts& own,
                                                const std::vector<int>& kept,
                                                const std::vector<const sim::TetMesh*>& meshes) const {
  std::vector<std::vector<Polygon>> drawn(meshes.size());
  if (closed_) {
    Polyhedron solid = *closed_;
    for (const auto& wall : cell.walls) solid = clip(std::move(solid), wall.normal, wall.offset, 0);
    for (const Polyhedron& one : parts(solid)) {
      std::vector<Polygon>& to = drawn[nearest_part(meshes, one.points)];
      for (const Polyhedron::Face& face : one.faces)
        for (const Triangle& t : triangles_of(one.points, face.loops))
          to.push_back({one.points[t[0]], one.points[t[1]], one.points[t[2]]});
    }
  } else {
    for (const Triangle& t : render_.triangles) {
      const auto& X = render_.vertices;
      Polygon polygon{X[t[0]], X[t[1]], X[t[2]]};
      for (const auto& wall : cell.walls) polygon = clip(polygon, wall.normal, wall.offset);
      if (!polygon.empty()) drawn[nearest_part(meshes, polygon)].push_back(std::move(polygon));
    }
    for (std::size_t k = 0; k < own.walls.size(); ++k)
      for (const TetPiece::Face& face : own.walls[k])
        if (kept[own.part[k]] >= 0) drawn[kept[own.part[k]]].push_back(own.cut.polygon(face));
  }
  std::vector<sim::SurfaceMesh> out;
  for (const std::vector<Polygon>& of_part : drawn) out.push_back(surface_of_polygons(of_part));
  return out;
}

}  // namespace crumple::authoring
