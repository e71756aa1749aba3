#include "server/sim/contact/swept_surface.h"

#include "server/sim/mesh/tet_faces.h"

#include <algorithm>

namespace crumple::sim::contact {

SweptSurface::SweptSurface(const Detector& d, const Unit& u, const Box3& zone) : detector(d), unit(u) {
  for (int k = 0; k < static_cast<int>(u.way_boxes.size()); ++k) {
    if (!u.way_boxes[k].intersects(zone)) continue;
    const int at = u.component->begin + k;
    const CollisionTet& tet = d.tet(u, at);
    for (int face = 0; face < 4; ++face) {
      if (!(tet.exterior >> face & 1)) continue;
      SurfaceFace& out = faces.emplace_back();
      out.tet = at;
      for (int corner = 0; corner < 3; ++corner) out.nodes[corner] = tet.nodes[kTetFaces[face][corner]];
      for (const int node : out.nodes) nodes.push_back({node, at});
    }
  }
  std::ranges::stable_sort(nodes, {}, &SurfaceNode::node);
  const auto [first, last] = std::ranges::unique(nodes, {}, &SurfaceNode::node);
  nodes.erase(first, last);
}

void SweptSurface::find_edges() {
  std::vector<SurfaceEdge> sides;
  for (int f = 0; f < static_cast<int>(faces.size()); ++f)
    for (int corner = 0; corner < 3; ++corner) {
      const auto [a, b] = std::minmax(faces[f].nodes[corner], faces[f].nodes[(corner + 1) % 3]);
      sides.push_back({a, b, faces[f].tet, {f, -1}});
    }
  const auto ends = [](const SurfaceEdge& edge) { return std::pair(edge.a, edge.b); };
  std::ranges::stable_sort(sides, {}, ends);
  for (const SurfaceEdge& side : sides) {
    if (!edges.empty() && ends(edges.back()) == ends(side)) edges.back().faces[1] = side.faces[0];
    else edges.push_back(side);
  }
}

Box3 SweptSurface::box(std::span<const int> of, double margin) const {
  Box3 result;
  for (const int node : of) {
    result.extend(start(node));
    result.extend(Vec3(start(node) + way(node)));
  }
  return {result.min() - Vec3::Constant(margin), result.max() + Vec3::Constant(margin)};
}

Vec3 SweptSurface::outward(const SurfaceEdge& edge, double t) const {
  Vec3 sum = Vec3::Zero();
  for (const int f : edge.faces) {
    if (f < 0) continue;
    const auto at = [&](int corner) -> Vec3 { return start(faces[f].nodes[corner]) + t * way(faces[f].nodes[corner]); };
    sum += (at(1) - at(0)).cross(at(2) - at(0)).normalized();
  }
  return sum;
}

}  // namespace crumple::sim::contact
