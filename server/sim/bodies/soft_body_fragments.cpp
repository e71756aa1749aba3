#include "server/sim/bodies/soft_body.h"

#include "server/sim/fracture/fragments.h"
#include "server/sim/mesh/keep.h"

#include <Eigen/LU>

#include <algorithm>

// How small pieces of a broken body leave it, to go on as rigid ones.
namespace crumple::sim {
namespace {

// A piece leaves with the shape that it has: not while its tets are strained by more, or squeezed to less.
constexpr double kLargestStrain = 0.1;   // |elastic stress| / 2 mu [-]
constexpr double kSmallestVolume = 0.2;  // of the rest volume

// As find_fragments, without looking for them again.
fracture::Fragments pieces_of(const contact::CollisionMesh& mesh) {
  fracture::Fragments pieces;
  pieces.of_tet.resize(mesh.tets.size());
  for (const contact::CollisionComponent& component : mesh.components) {
    for (int k = component.begin; k < component.end; ++k) pieces.of_tet[mesh.tets[k].id] = pieces.count();
    pieces.size.push_back(component.end - component.begin);
  }
  return pieces;
}

}  // namespace

bool SoftBody::is_near_rest(int t) const {
  const double volume = fem::edge_matrix(fem::gather(state.x, tets[t])).determinant() / 6;
  return volume > kSmallestVolume * rest.volume[t] &&
         fem::element_stress(rest, system.elements, t).norm() <= kLargestStrain * 2 * rest.lame_of(t).mu;
}

// By piece: whether it may leave now. Sets small_pieces_.
std::vector<char> SoftBody::leaving(const fracture::Fragments& pieces) {
  std::vector<char> leaves(pieces.count(), 0);
  small_pieces_ = false;
  for (int p = 0; p < pieces.count(); ++p) leaves[p] = pieces.size[p] <= rigid_fragment_tets_;
  std::vector<int> owner(node_count(), -1);
  std::vector<char> strained(pieces.count(), 0);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const int p = pieces.of_tet[t];
    for (const int n : tets[t]) {
      // Pieces that were made with a common node stay with each other.
      if (owner[n] >= 0 && owner[n] != p) leaves[owner[n]] = leaves[p] = 0;
      if (fixed[n]) leaves[p] = 0;
      owner[n] = p;
    }
    if (leaves[p] && !strained[p] && !is_near_rest(static_cast<int>(t))) strained[p] = 1;
  }
  for (int p = 0; p < pieces.count(); ++p) {
    small_pieces_ = small_pieces_ || (leaves[p] && strained[p]);
    leaves[p] = leaves[p] && !strained[p];
  }
  return leaves;
}

SoftBody::HandOver SoftBody::hand_over(const ThreadPool& pool) {
  HandOver moved;
  if (!small_pieces_ || frozen) return moved;
  const fracture::Fragments pieces = pieces_of(collision);
  if (!system.elements.is_of(rest)) fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
  const std::vector<char> leaves = leaving(pieces);
  moved.count = static_cast<int>(std::ranges::count(leaves, 1));
  if (moved.count == 0) return moved;

  const int before = static_cast<int>(fragments.size());
  std::vector<int> fragment_of(pieces.count(), -1);
  std::vector<RigidFragment::Piece> made(moved.count);
  for (int p = 0, k = 0; p < pieces.count(); ++p)
    if (leaves[p]) fragment_of[p] = k++;

  moved.tet.assign(tets.size(), -1);
  moved.node.assign(node_count(), {});
  std::vector<int> kept_tets, kept_nodes;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const int k = fragment_of[pieces.of_tet[t]];
    if (k < 0) {
      moved.tet[t] = static_cast<int>(kept_tets.size());
      kept_tets.push_back(t);
      continue;
    }
    RigidFragment::Piece& piece = made[k];
    scene_tets_[scene_tet_of_[t]] = {before + k, static_cast<int>(piece.tets.size())};
    piece.tets.push_back(tets[t]);  // node ids follow below
    piece.tet_mass.push_back(tet_mass_[t]);
    piece.plastic_strain.push_back(fem::element_plastic_strain(rest, state.plastic_strain, t));
    if (rest.heterogeneous()) piece.material_id.push_back(rest.material_id[t]);
    for (const int n : tets[t]) moved.node[n].fragment = before + k;
  }
  for (int n = 0; n < node_count(); ++n) {
    NodeRef& to = moved.node[n];
    if (to.fragment < 0) {
      to.node = static_cast<int>(kept_nodes.size());
      kept_nodes.push_back(n);
      continue;
    }
    RigidFragment::Piece& piece = made[to.fragment - before];
    to.node = static_cast<int>(piece.X.size());
    piece.X.push_back(X[n]);
    piece.x.push_back(state.x[n]);
    piece.v.push_back(state.v[n]);
    piece.node_mass.push_back(rest.node_mass[n]);
  }
  for (RigidFragment::Piece& piece : made) {
    for (Tet& tet : piece.tets)
      for (int& n : tet) n = moved.node[n].node;
    piece.friction = material().friction;
    fragments.emplace_back(std::move(piece));
  }
  keep_part(kept_tets, kept_nodes, moved);
  return moved;
}

// What stays, under its new ids.
void SoftBody::keep_part(std::span<const int> kept_tets, std::span<const int> kept_nodes, const HandOver& moved) {
  const auto follow = [&](int& node) { node = moved.node[node].node; };
  keep(tets, kept_tets);
  for (Tet& tet : tets) std::ranges::for_each(tet, follow);
  keep(tet_mass_, kept_tets);
  fem::keep_tets(rest, kept_tets);
  fem::Elements& elements = system.elements;
  keep(elements.Q, kept_tets);
  keep(elements.sigma, kept_tets);
  keep(elements.force, kept_tets);
  keep(elements.core, kept_tets);

  for (std::vector<Vec3>* values : {&X, &state.x, &state.v, &state.x_before, &state.v_before}) keep(*values, kept_nodes);
  keep(fixed, kept_nodes);
  for (DrivenNodes& driven : driven_) std::ranges::for_each(driven.motion.nodes, follow);
  for (auto* prescribed : {&prescribed_, &prescribed_before_})
    for (fem::PrescribedNode& p : *prescribed) follow(p.node);
  for (NodeRef& ref : scene_nodes_)
    if (ref.fragment < 0) ref = moved.node[ref.node];
  keep(scene_tet_of_, kept_tets);
  for (std::size_t t = 0; t < scene_tet_of_.size(); ++t) scene_tets_[scene_tet_of_[t]].tet = static_cast<int>(t);
  skin_.follow(moved.node);
  if (rest.grouped()) {
    state.plastic_strain = fem::inherited(state.plastic_strain, follow_topology());
  } else {
    keep(state.plastic_strain, kept_tets);
    follow_topology();
  }
  stars_ = NodeStars(tets, node_count());
  command_force_.resize(0);
  std::vector<int> new_node;
  for (const NodeRef& to : moved.node) new_node.push_back(to.node);
  follow_mesh(contact::kept_components(collision, moved.tet, new_node));
}

double SoftBody::mass() const {
  double mass = rest.mass();
  for (const RigidFragment& fragment : fragments) mass += fragment.mass();
  return mass;
}

void SoftBody::push_node(const NodeRef& at, const Vec3& impulse_W) {
  if (at.fragment >= 0) {
    fragments[at.fragment].push(impulse_W, at.node);
  } else {
    impulse.segment<3>(3 * at.node) += impulse_W;
  }
}

std::vector<Vec3> SoftBody::all_positions() const {
  std::vector<Vec3> x = state.x;
  for (const RigidFragment& fragment : fragments) x.insert(x.end(), fragment.x().begin(), fragment.x().end());
  return x;
}

}  // namespace crumple::sim
