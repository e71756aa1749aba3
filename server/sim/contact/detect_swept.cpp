#include "server/sim/contact/detector.h"
#include "server/sim/contact/swept_encounters.h"
#include "server/sim/contact/swept_surface.h"

#include <algorithm>
#include <array>

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
  if (in.settings.raw_damping || are_pieces_of_one(a, b) || is_fragment(a.body) || is_fragment(b.body)) return false;
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
