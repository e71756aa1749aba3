#include "server/sim/contact/swept_encounters.h"

#include "server/sim/contact/feature_crossing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace crumple::sim::contact {
namespace {

// What keeps a feature from passing: where it comes in, if it leaves again in the step. One that starts inside has come in
// behind it, unless it is more than half through. `one`: of one feature.
struct Entry {
  Encounter encounter;
  bool passes;
};
std::optional<Entry> entry_of(std::span<Encounter> one) {
  static_assert(alignof(Encounter) <= alignof(std::max_align_t));  // g++ 12 sorts in memory that is aligned no further
  std::ranges::stable_sort(one, {}, &Encounter::t);
  const auto first = std::ranges::find_if(one, [](const Encounter& e) { return e.t >= 0; });
  if (first == one.end()) return std::nullopt;
  if (first->enters) {
    return Entry{*first, std::any_of(first, one.end(), [&](const Encounter& e) { return !e.enters && e.t > first->t; })};
  }
  if (first == one.begin() || !std::prev(first)->enters || -std::prev(first)->t >= first->t) return std::nullopt;
  return Entry{*std::prev(first), true};
}

// p, d: as for node_through_triangle.
std::optional<Neighbour> neighbour(int own, int other, const Mat34& p, const Mat34& d, double reach) {
  const Vec3 e1 = p.col(2) - p.col(1), e2 = p.col(3) - p.col(1), r = p.col(0) - p.col(1), n = e1.cross(e2);
  const double squared = n.squaredNorm();
  if (!(squared > 0)) return std::nullopt;
  const double b2 = r.cross(e2).dot(n) / squared, b3 = e1.cross(r).dot(n) / squared, distance = r.dot(n) / std::sqrt(squared);
  if (!(b2 >= 0 && b3 >= 0 && b2 + b3 <= 1 && distance >= 0 && distance <= reach)) return std::nullopt;
  const Eigen::Vector4d weights(1, 1 - b2 - b3, b2, b3);
  const Vec3 relative = d.col(0) - d.rightCols<3>() * weights.tail<3>();
  return Neighbour{{own, other, 0, true, n.normalized(), weights, relative}, distance};
}

}  // namespace

std::vector<Encounter> nodes_through_faces(const SweptSurface& own, const SweptSurface& other, double margin,
                                           std::vector<Neighbour>& near) {
  std::vector<Box3> points, triangles;
  for (const SurfaceNode& node : own.nodes) points.push_back(own.box(std::span(&node.node, 1), margin));
  for (const SurfaceFace& face : other.faces) triangles.push_back(other.box(face.nodes, margin));
  std::vector<IndexPair> pairs;
  sweep_and_prune(points, triangles, pairs);
  std::vector<Encounter> found;
  std::vector<char> crosses(own.nodes.size(), 0);
  near.clear();
  Mat34 p, d;
  for (const auto& [i, j] : pairs) {
    const int node = own.nodes[i].node;
    const Triangle& corners = other.faces[j].nodes;
    p << own.start(node), other.start(corners[0]), other.start(corners[1]), other.start(corners[2]);
    d << own.way(node), other.way(corners[0]), other.way(corners[1]), other.way(corners[2]);
    if (const auto close = neighbour(i, j, p, d, 2 * margin)) {
      if (near.empty() || near.back().encounter.own != i) near.push_back(*close);
      else if (close->distance < near.back().distance) near.back() = *close;
    }
    const FeatureCrossings crossings = node_through_triangle(p, d, -1);
    for (int k = 0; k < crossings.count; ++k) {
      const FeatureCrossing& at = crossings.at[k];
      crosses[i] |= at.t >= 0;
      found.push_back({i, j, at.t, at.normal.dot(at.relative) < 0, at.normal, at.weights, at.relative});
    }
  }
  std::erase_if(near, [&](const Neighbour& n) { return crosses[n.encounter.own] != 0; });
  return found;
}

std::vector<Encounter> edges_through_edges(const SweptSurface& own, const SweptSurface& other, double margin) {
  std::vector<Box3> boxes, others;
  for (const SurfaceEdge& edge : own.edges) boxes.push_back(own.box(std::array{edge.a, edge.b}, margin));
  for (const SurfaceEdge& edge : other.edges) others.push_back(other.box(std::array{edge.a, edge.b}, margin));
  std::vector<IndexPair> pairs;
  sweep_and_prune(boxes, others, pairs);
  std::vector<Encounter> found;
  Mat34 p, d;
  for (const auto& [i, j] : pairs) {
    const SurfaceEdge &e = own.edges[i], &g = other.edges[j];
    p << own.start(e.a), own.start(e.b), other.start(g.a), other.start(g.b);
    d << own.way(e.a), own.way(e.b), other.way(g.a), other.way(g.b);
    const FeatureCrossings crossings = edge_through_edge(p, d, -1);
    for (int k = 0; k < crossings.count; ++k) {
      const FeatureCrossing& at = crossings.at[k];
      const double own_side = at.normal.dot(own.outward(e, at.t)), other_side = at.normal.dot(other.outward(g, at.t));
      if (!(own_side * other_side < 0)) continue;
      const Vec3 normal = other_side > 0 ? at.normal : Vec3(-at.normal);
      found.push_back({i, j, at.t, normal.dot(at.relative) < 0, normal, at.weights, at.relative});
    }
  }
  return found;
}

void swap_sides(std::vector<Encounter>& encounters) {
  for (Encounter& e : encounters) {
    std::swap(e.own, e.other);
    e.normal = -e.normal;
    e.relative = -e.relative;
    e.weights << e.weights.tail<2>().eval(), e.weights.head<2>().eval();
  }
  std::ranges::stable_sort(encounters, {}, &Encounter::own);
}

std::vector<Encounter> passing(std::vector<Encounter>& encounters) {
  std::vector<Encounter> entries;
  bool any = false;
  for (std::size_t begin = 0; begin < encounters.size();) {
    std::size_t end = begin + 1;
    while (end < encounters.size() && encounters[end].own == encounters[begin].own) ++end;
    if (const auto entry = entry_of(std::span(encounters).subspan(begin, end - begin))) {
      entries.push_back(entry->encounter);
      any = any || entry->passes;
    }
    begin = end;
  }
  if (!any) entries.clear();
  return entries;
}

}  // namespace crumple::sim::contact
