#include "server/sim/rigid/convex_hull.h"

#include <LinearMath/btConvexHullComputer.h>

#include <cmath>

namespace crumple::sim {

Result<SurfaceMesh> convex_hull(std::span<const Vec3> points, const std::string& field) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) {
    if (!p.allFinite()) return invalid(field, "has a non-finite point");
    box.extend(p);
  }
  const auto flat = [&] { return invalid(field, "has points that span no volume"); };
  if (points.size() < 4) return flat();

  btConvexHullComputer computer;
  computer.compute(points[0].data(), sizeof(Vec3), static_cast<int>(points.size()), 0, 0);
  SurfaceMesh hull;
  for (int i = 0; i < computer.vertices.size(); ++i) {
    hull.vertices.push_back(points[computer.original_vertex_index[i]]);
  }
  double volume = 0;
  const Vec3 centre = box.center();
  for (int f = 0; f < computer.faces.size(); ++f) {
    const btConvexHullComputer::Edge* edge = &computer.edges[computer.faces[f]];
    const int a = edge->getSourceVertex();
    int b = edge->getTargetVertex();
    for (edge = edge->getNextEdgeOfFace(); edge->getTargetVertex() != a; edge = edge->getNextEdgeOfFace()) {
      const int c = edge->getTargetVertex();
      hull.triangles.push_back({a, b, c});
      volume += (hull.vertices[a] - centre).dot((hull.vertices[b] - centre).cross(hull.vertices[c] - centre)) / 6;
      b = c;
    }
  }
  if (volume < 0) {  // the computer's faces run the other way round
    for (Triangle& t : hull.triangles) std::swap(t[1], t[2]);
    volume = -volume;
  }
  if (!(volume > 1e-9 * std::pow(box.diagonal().norm(), 3))) return flat();
  return hull;
}

}  // namespace crumple::sim
