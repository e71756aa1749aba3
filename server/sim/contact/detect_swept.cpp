#include "server/sim/contact/detector.h"
#include "server/sim/contact/feature_crossing.h"
#include "server/sim/mesh/tet_faces.h"

#include <algorithm>
#include <array>
#include <optional>

// Units that would pass wholly through each other in the step. An overlap at any instant says nothing about that: there is none
// between two samples, and one that holds both sides of a thin body has no direction. Nodes are followed through triangles, and
// edges through edges where no node passes; what comes in and goes out again gets a row.
//
// A body that is struck, or turns, changes its velocities within the step by as much as they differ in it now: what is closer than
// the thinner one is thick then has a row as well, which holds it off if the solve would let it come.
//
// All rows of a pair stop it where its first features meet, as the paper moves a fast body to its interpolated place there
// [section 6], but by impulses on both sides, so that momentum is kept: what is behind keeps its distance, and nothing is
// flattened that is faster than its sound.
namespace crumple::sim::contact {
namespace {

// What of the thinner one's thickness is left between the two: the solve stops them a little late.
constexpr double kMargin = 0.1;
// Impulses are given for bodies that stop as one, and rows as strong as this times kappa take what that is amiss.
constexpr double kSweptKappa = 10;

struct SurfaceNode {
  int node, tet;  // tet: in CollisionMesh::tets
};
struct SurfaceFace {
  Triangle nodes;
  int tet;
};
struct SurfaceEdge {
  int a, b, tet;
  std::array<int, 2> faces;  // in SweptSurface::faces; the second -1 where it is not near
};

// The part of a unit's surface whose way comes near another unit.
struct SweptSurface {
  const Detector& detector;
  const Unit& unit;
  std::vector<SurfaceNode> nodes;  // ascending
  std::vector<SurfaceFace> faces;
  std::vector<SurfaceEdge> edges;

  SweptSurface(const Detector& d, const Unit& u, const Box3& zone) : detector(d), unit(u) {
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

  void find_edges() {
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

  Vec3 start(int node) const { return detector.in.bodies[unit.body].x[node]; }
  Vec3 way(int node) const { return detector.placed[unit.body].x[node] - start(node); }
  Box3 box(std::span<const int> of, double margin) const {
    Box3 result;
    for (const int node : of) {
      result.extend(start(node));
      result.extend(Vec3(start(node) + way(node)));
    }
    return {result.min() - Vec3::Constant(margin), result.max() + Vec3::Constant(margin)};
  }
  // Sum of the unit normals of an edge's faces at time t.
  Vec3 outward(const SurfaceEdge& edge, double t) const {
    Vec3 sum = Vec3::Zero();
    for (const int f : edge.faces) {
      if (f < 0) continue;
      const auto at = [&](int corner) -> Vec3 { return start(faces[f].nodes[corner]) + t * way(faces[f].nodes[corner]); };
      sum += (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    }
    return sum;
  }
};

// A feature of one unit crosses the other's surface.
struct Encounter {
  int own, other;            // features
  double t;                  // below 0: where it would have been before the step, moving as it does
  bool enters;               // or leaves
  Vec3 normal;               // unit, out of the other's surface
  Eigen::Vector4d weights;   // of own, then of the other's points; positive
  Vec3 relative;             // way of own less that of the other [m]
};

// What keeps a feature from passing: where it comes in, if it leaves again in the step. One that starts inside has come in
// behind it, unless it is more than half through. `one`: of one feature.
struct Entry {
  Encounter encounter;
  bool passes;
};
std::optional<Entry> entry_of(std::span<Encounter> one) {
  std::ranges::stable_sort(one, {}, &Encounter::t);
  const auto first = std::ranges::find_if(one, [](const Encounter& e) { return e.t >= 0; });
  if (first == one.end()) return std::nullopt;
  if (first->enters) {
    return Entry{*first, std::any_of(first, one.end(), [&](const Encounter& e) { return !e.enters && e.t > first->t; })};
  }
  if (first == one.begin() || !std::prev(first)->enters || -std::prev(first)->t >= first->t) return std::nullopt;
  return Entry{*std::prev(first), true};
}

// Of each feature its entry; nothing if none passes. encounters: grouped by `own`.
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

// A node that stays outside a triangle, by how much it stands over it at the start of the step.
struct Neighbour {
  Encounter encounter;
  double distance;  // [m]
};

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

// near: the nearest triangle of each node that crosses none in the step.
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

// Crossings at which both surfaces look the way of the normal, or both the other way; where they do not, edges graze.
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

// As seen from the other side.
void swap_sides(std::vector<Encounter>& encounters) {
  for (Encounter& e : encounters) {
    std::swap(e.own, e.other);
    e.normal = -e.normal;
    e.relative = -e.relative;
    e.weights << e.weights.tail<2>().eval(), e.weights.head<2>().eval();
  }
  std::ranges::stable_sort(encounters, {}, &Encounter::own);
}

// One side of a row: its points and their weights.
struct RowSide {
  const Unit& unit;
  int tet;
  std::span<const int> nodes;
  std::span<const double> weights;
};

}  // namespace

bool Detector::changes(const Unit& a, const Unit& b) const {
  const double most = std::max(a.moves.diagonal().norm(), b.moves.diagonal().norm());
  return most > std::min(a.component->thickness, b.component->thickness);
}

bool Detector::may_pass(const Unit& a, const Unit& b) const {
  if (in.settings.raw_damping || a.body == b.body || is_fragment(a.body) || is_fragment(b.body)) return false;
  const Vec3 most = (a.moves.max() - b.moves.min()).cwiseMax(b.moves.max() - a.moves.min());
  return most.norm() > std::min(a.component->thickness, b.component->thickness);
}

void Detector::fill_way_boxes(Unit& unit) const {
  unit.way_boxes.clear();
  for (int k = unit.component->begin; k < unit.component->boundary_end; ++k) {
    const Mat34 start = at_start(unit, tet(unit, k)), end = nodes(unit, tet(unit, k));
    unit.way_boxes.emplace_back(start.rowwise().minCoeff().cwiseMin(end.rowwise().minCoeff()),
                                start.rowwise().maxCoeff().cwiseMax(end.rowwise().maxCoeff()));
  }
}

void Detector::add_swept_side(ContactRow& row, int side, double t, const Unit& unit, int tet_at, std::span<const int> nodes,
                              std::span<const double> weights) const {
  const CollisionBody& body = in.bodies[unit.body];
  const double sign = side == 0 ? 1 : -1;
  ContactSide& s = row.sides[side];
  s.body = unit.body;
  s.tet = in.bodies[unit.body].mesh->tets[tet_at].id;
  if (body.rigid) {
    set_rigid(row, side, std::max(t, 0.0), *body.rigid);
    if (!s.rigid) row.known_velocity += sign * (body.rigid->v + body.rigid->w.cross(s.arm));
    return;
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (!body.fixed.empty() && body.fixed[nodes[k]]) {
      row.known_velocity += sign * weights[k] * body.v[nodes[k]];
    } else {
      s.nodes[s.node_count] = nodes[k];
      s.weights[s.node_count++] = sign * weights[k];
    }
  }
}

bool Detector::meet_swept(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const {
  const double thickness = std::min(a.component->thickness, b.component->thickness), margin = 0.5 * thickness;
  Box3 zone = a.way_box.intersection(b.way_box);
  if (zone.isEmpty()) return false;
  zone = Box3(zone.min() - Vec3::Constant(margin), zone.max() + Vec3::Constant(margin));
  SweptSurface surface_a(*this, a, zone), surface_b(*this, b, zone);
  if (surface_a.faces.empty() || surface_b.faces.empty()) return false;

  std::vector<Neighbour> near_b, near_a;
  auto in_b = nodes_through_faces(surface_a, surface_b, margin, near_b), in_a = nodes_through_faces(surface_b, surface_a, margin, near_a);
  std::vector<Encounter> a_passes = passing(in_b), b_passes = passing(in_a), edges_pass;
  if (a_passes.empty() && b_passes.empty()) {
    surface_a.find_edges();
    surface_b.find_edges();
    auto crossed = edges_through_edges(surface_a, surface_b, margin);
    edges_pass = passing(crossed);
    if (edges_pass.empty()) {
      swap_sides(crossed);
      edges_pass = passing(crossed);
      swap_sides(edges_pass);
    }
  }
  if (!changes(a, b)) near_a.clear(), near_b.clear();
  const std::size_t passing_count = a_passes.size() + b_passes.size() + edges_pass.size();
  const std::size_t count = passing_count + near_a.size() + near_b.size();
  if (count == 0) return false;
  double first = 1;
  for (const auto* some : {&a_passes, &b_passes, &edges_pass})
    for (const Encounter& e : *some) first = std::min(first, std::max(e.t, 0.0));

  const double share = 1.0 / static_cast<double>(count), kappa = kSweptKappa * std::max(in.settings.kappa, 1.0);
  const double left = kMargin * thickness;
  const Share pair = share_of(a, b);
  // gap: by how much the two may come closer [m]; closing: by how much they would.
  const auto add = [&](const Encounter& e, const RowSide& own, const RowSide& other, bool own_is_a, double gap, double closing) {
    ContactRow& row = rows.emplace_back();
    row.swept = true;
    row.normal = own_is_a ? e.normal : Vec3(-e.normal);
    const double at = std::max(e.t, 0.0);
    for (std::size_t k = 0; k < own.nodes.size(); ++k) {
      const Vec3 start = in.bodies[own.unit.body].x[own.nodes[k]];
      row.point += own.weights[k] * ((1 - at) * start + at * placed[own.unit.body].x[own.nodes[k]]);
    }
    set_friction(row, in.bodies[a.body].friction, in.bodies[b.body].friction);
    add_swept_side(row, own_is_a ? 0 : 1, at, own.unit, own.tet, own.nodes, own.weights);
    add_swept_side(row, own_is_a ? 1 : 0, at, other.unit, other.tet, other.nodes, other.weights);
    row.depth = -gap;
    row.area = share * pair.volume / thickness;
    row.volume = row.area * left;
    row.mass = share * pair.mass;
    row.c_n = kappa * row.mass;
    row.target = -gap / in.dt + std::max(closing - gap, 0.0) / (in.dt * kappa);
  };
  const auto add_node = [&](const Encounter& e, const SweptSurface& own, const SweptSurface& other, double gap, double closing) {
    const SurfaceNode& node = own.nodes[e.own];
    const SurfaceFace& face = other.faces[e.other];
    const std::span<const double> w(e.weights.data(), 4);
    add(e, {own.unit, node.tet, std::span(&node.node, 1), w.first(1)}, {other.unit, face.tet, face.nodes, w.last(3)},
        &own == &surface_a, gap, closing);
  };
  const auto way_to_first = [&](const Encounter& e) { return std::max(-first * e.normal.dot(e.relative) - left, 0.0); };
  const auto way = [](const Encounter& e) { return -e.normal.dot(e.relative); };
  for (const Encounter& e : a_passes) add_node(e, surface_a, surface_b, way_to_first(e), way(e));
  for (const Encounter& e : b_passes) add_node(e, surface_b, surface_a, way_to_first(e), way(e));
  for (const Encounter& e : edges_pass) {
    const SurfaceEdge &edge_a = surface_a.edges[e.own], &edge_b = surface_b.edges[e.other];
    const std::array ends_a{edge_a.a, edge_a.b}, ends_b{edge_b.a, edge_b.b};
    const std::span<const double> w(e.weights.data(), 4);
    add(e, {a, edge_a.tet, ends_a, w.first(2)}, {b, edge_b.tet, ends_b, w.last(2)}, true, way_to_first(e), way(e));
  }
  for (const auto& [e, distance] : near_b) add_node(e, surface_a, surface_b, std::max(distance - left, 0.0), 0);
  for (const auto& [e, distance] : near_a) add_node(e, surface_b, surface_a, std::max(distance - left, 0.0), 0);
  rows.front().pair = 1;
  return passing_count > 0;
}

// Of soft bodies what would pass has the rows of that and no others: a row stops what it touches, not what is behind it. What
// moves rigidly stops as a whole, so that where it overlaps the other anywhere on its way that is enough.
void Detector::meet_pair(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const {
  const auto moves_rigidly = [&](const Unit& unit) { return in.bodies[unit.body].rigid && in.bodies[unit.body].rigid->movable; };
  const bool swept = may_pass(a, b), any_rigid = moves_rigidly(a) || moves_rigidly(b);
  const bool overlap = a.box.intersects(b.box);
  if (swept && any_rigid) {
    if (overlap) meet(a, b, rows);
    if (rows.empty()) meet_swept(a, b, rows);
    return;
  }
  std::vector<ContactRow> passing;
  const bool passes = swept && meet_swept(a, b, passing);
  if (!passes && overlap) meet(a, b, rows);
  if (!passing.empty()) passing.front().pair = rows.empty() ? 1 : 0;
  rows.insert(rows.end(), passing.begin(), passing.end());
}

}  // namespace crumple::sim::contact
