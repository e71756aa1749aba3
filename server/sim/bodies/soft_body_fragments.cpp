#include "server/sim/bodies/soft_body.h"

#include "server/sim/fem/float_matrix.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/keep.h"

#include <Eigen/LU>

#include <algorithm>
#include <numeric>
#include <utility>

// How pieces of a broken mesh leave it: small ones to go on as rigid fragments, large ones as meshes of their own.
namespace crumple::sim {
namespace {

// A piece leaves as a rigid one with the shape that it has: not while its tets are strained by more, or squeezed to less.
constexpr double kLargestStrain = 0.1;   // |elastic stress| / 2 mu [-]
constexpr double kSmallestVolume = 0.2;  // of the rest volume
// Small pieces that may not leave so are not worth a system each: those of a step go into one mesh, apart from what is large.
constexpr int kSmallPiece = 9;           // [tets]; or that of a rigid fragment, if that is larger

// As find_fragments, without looking for them again.
fracture::Fragments components_of(const contact::CollisionMesh& mesh) {
  fracture::Fragments components;
  components.of_tet.resize(mesh.tets.size());
  for (const contact::CollisionComponent& component : mesh.components) {
    for (int k = component.begin; k < component.end; ++k) components.of_tet[mesh.tets[k].id] = components.count();
    components.size.push_back(component.end - component.begin);
  }
  return components;
}

// Components that have a node in common, made so or linked by an edge, are one piece. By component: the lowest one of its piece.
std::vector<int> linked_components(const contact::CollisionMesh& mesh, int node_count) {
  std::vector<int> root(mesh.components.size()), owner(node_count, -1);
  std::iota(root.begin(), root.end(), 0);
  for (int c = 0; c < static_cast<int>(root.size()); ++c) {
    for (const int n : mesh.nodes_of(mesh.components[c])) {
      if (owner[n] >= 0) unite(root, owner[n], c);
      owner[n] = c;
    }
  }
  for (int c = 0; c < static_cast<int>(root.size()); ++c) root[c] = find_root(root, c);
  return root;
}

}  // namespace

bool SoftBody::is_near_rest(int t) const {
  const double volume = fem::edge_matrix(fem::gather(state.x, tets[t])).determinant() / 6;
  return volume > kSmallestVolume * rest.volume[t] &&
         fem::element_stress(rest, system.elements, t).norm() <= kLargestStrain * 2 * rest.lame_of(t).mu;
}

// Sets may_part_.
SoftBody::Leaving SoftBody::leaving(const fracture::Fragments& components) {
  may_part_ = false;
  const std::vector<int> piece_of = linked_components(collision, node_count());
  const int count = components.count();
  std::vector<int> size(count, 0), parts(count, 0);
  for (int c = 0; c < count; ++c) size[piece_of[c]] += components.size[c], ++parts[piece_of[c]];
  std::vector<char> is_rigid(count), strained(count, 0);
  for (int c = 0; c < count; ++c) is_rigid[c] = parts[piece_of[c]] == 1 && size[c] <= rigid_fragment_tets_;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const int c = components.of_tet[t];
    if (!is_rigid[c]) continue;
    for (const int n : tets[t])
      if (fixed[n]) is_rigid[c] = 0;
    if (is_rigid[c] && !strained[c] && !is_near_rest(static_cast<int>(t))) strained[c] = 1;
  }
  const int small = std::max(kSmallPiece, rigid_fragment_tets_);
  const int stays = static_cast<int>(std::ranges::max_element(size) - size.begin());
  Leaving result{.as = std::vector<int>(count, -1)};
  for (int c = 0; c < count; ++c)
    if (is_rigid[c] && !strained[c]) result.as[c] = result.fragments++;
  int of_small = -1;
  for (int c = 0; c < count; ++c) {
    const int piece = piece_of[c];
    if (result.as[c] >= 0 || piece == stays) continue;
    if (size[piece] > small) {
      result.as[c] = c == piece ? result.fragments + result.meshes++ : result.as[piece];
    } else if (size[stays] > small) {
      if (of_small < 0) of_small = result.fragments + result.meshes++;
      result.as[c] = of_small;
    }
  }
  for (int c = 0; c < count; ++c) may_part_ = may_part_ || (is_rigid[c] && strained[c] && result.as[c] < 0);
  return result;
}

SoftBody::HandOver SoftBody::hand_over(const ThreadPool& pool) {
  HandOver moved;
  if (!may_part_ || frozen || is_empty()) return moved;
  const fracture::Fragments components = components_of(collision);
  if (!system.elements.is_of(rest)) fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
  const auto [as, fragment_count, mesh_count] = leaving(components);
  const int count = fragment_count + mesh_count;
  if (count == 0) return moved;

  std::vector<Part> parts(count + 1);  // the last one: what stays
  const auto part_of = [&](int left_as) -> Part& { return parts[left_as < 0 ? count : left_as]; };
  for (int c = 0; c < components.count(); ++c) part_of(as[c]).components.push_back(c);
  std::vector<int> new_tet(tets.size()), new_node(node_count());
  moved.tet.resize(tets.size());
  moved.node.assign(node_count(), {-1, 0});
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const int to = as[components.of_tet[t]];
    std::vector<int>& list = part_of(to).tets;
    moved.tet[t] = {to, new_tet[t] = static_cast<int>(list.size())};
    list.push_back(t);
    for (const int n : tets[t]) moved.node[n].piece = to;
  }
  for (int n = 0; n < node_count(); ++n) {
    std::vector<int>& list = part_of(moved.node[n].piece).nodes;
    moved.node[n].node = new_node[n] = static_cast<int>(list.size());
    list.push_back(n);
  }
  moved.fragments = fragment_count;
  for (int k = 0; k < fragment_count; ++k) fragments.emplace_back(rigid_part(parts[k], moved));
  moved.meshes.resize(mesh_count);
  pool.for_jobs(mesh_count, [&](int k) {
    const Part& part = parts[fragment_count + k];
    SoftBody& mesh = moved.meshes[k] = mesh_part(part);
    mesh.follow_parting(moved, fragment_count + k, state.plastic_strain, part.tets,
                        contact::kept_components(collision, part.components, new_tet, new_node));
    mesh.system = fem::StepSystem(options_.float_solver ? *options_.float_solver : fem::takes_float(mesh.rest, options_.dt));
    fem::update_elements(mesh.rest, mesh.tets, mesh.state.x, mesh.state.plastic_strain, pool, mesh.system.elements);
  });
  keep_part(parts[count]);
  follow_parting(moved, -1, std::exchange(state.plastic_strain, {}), parts[count].tets,
                 contact::kept_components(collision, parts[count].components, new_tet, new_node));
  return moved;
}

RigidFragment::Piece SoftBody::rigid_part(const Part& own, const HandOver& moved) const {
  RigidFragment::Piece part;
  for (const int t : own.tets) {
    Tet tet = tets[t];
    for (int& n : tet) n = moved.node[n].node;
    part.tets.push_back(tet);
    part.plastic_strain.push_back(fem::element_plastic_strain(rest, state.plastic_strain, t));
  }
  part.tet_mass = taken(tet_mass_, own.tets);
  part.material_id = taken(rest.material_id, own.tets);
  part.X = taken(X, own.nodes);
  part.x = taken(state.x, own.nodes);
  part.v = taken(state.v, own.nodes);
  part.node_mass = taken(rest.node_mass, own.nodes);
  part.friction = material().friction;
  return part;
}

// As this one is, but for what follow_parting does; nothing is known of its matrices and levels.
SoftBody SoftBody::mesh_part(const Part& own) const {
  SoftBody part;
  part.id = id;
  part.tets = taken(tets, own.tets);
  part.tet_mass_ = taken(tet_mass_, own.tets);
  part.rest = fem::part_of(rest, own.tets);
  part.X = taken(X, own.nodes);
  part.state.x = taken(state.x, own.nodes);
  part.state.v = taken(state.v, own.nodes);
  part.state.x_before = taken(state.x_before, own.nodes);
  part.state.v_before = taken(state.v_before, own.nodes);
  part.state.rough_steps = state.rough_steps;
  part.fixed = taken(fixed, own.nodes);
  part.driven_ = driven_;
  part.prescribed_ = prescribed_;
  part.prescribed_before_ = prescribed_before_;
  if (self_contact) part.self_contact.emplace();
  part.mean_tet_volume = mean_tet_volume;
  part.options_ = options_;
  part.pose_at_start_ = pose_at_start_;
  part.material_rotation_ = material_rotation_;
  part.value_scale_ = value_scale_;
  part.rigid_fragment_tets_ = rigid_fragment_tets_;
  part.whole_ = false;
  part.may_part_ = true;  // small ones, when they have calmed down
  part.was_rough_ = was_rough_;
  part.changed_while_prescribed_ = changed_while_prescribed_;
  return part;
}

// What stays, but for what follow_parting does.
void SoftBody::keep_part(const Part& own) {
  keep(tets, own.tets);
  keep(tet_mass_, own.tets);
  fem::keep_tets(rest, own.tets);
  fem::Elements& elements = system.elements;
  keep(elements.Q, own.tets);
  keep(elements.sigma, own.tets);
  keep(elements.force, own.tets);
  keep(elements.core, own.tets);
  for (std::vector<Vec3>* values : {&X, &state.x, &state.v, &state.x_before, &state.v_before}) keep(*values, own.nodes);
  keep(fixed, own.nodes);
  command_force_.resize(0);
}

// Arrays are those of one piece already, but under node ids of before. strain: the plastic one of all pieces.
void SoftBody::follow_parting(const HandOver& moved, int piece, const std::vector<Mat3>& strain, std::span<const int> own_tets,
                              contact::CollisionMesh mesh) {
  for (Tet& tet : tets)
    for (int& n : tet) n = moved.node[n].node;
  for (DrivenNodes& driven : driven_) {
    DrivenNodes own{{{}, driven.motion.keys}, {}};
    for (std::size_t k = 0; k < driven.at_start.size(); ++k) {
      const NodeRef to = moved.node[driven.motion.nodes[k]];
      if (to.piece != piece) continue;
      own.motion.nodes.push_back(to.node);
      own.at_start.push_back(driven.at_start[k]);
    }
    driven = std::move(own);
  }
  for (auto* prescribed : {&prescribed_, &prescribed_before_}) {
    std::erase_if(*prescribed, [&](const fem::PrescribedNode& p) { return moved.node[p.node].piece != piece; });
    for (fem::PrescribedNode& p : *prescribed) p.node = moved.node[p.node].node;
  }
  const std::vector<int> element_before = follow_topology();
  state.plastic_strain = rest.grouped() ? fem::inherited(strain, element_before) : taken(strain, own_tets);
  stars_ = NodeStars(tets, node_count());
  follow_mesh(std::move(mesh));
}

}  // namespace crumple::sim
