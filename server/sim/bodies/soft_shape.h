#pragma once

#include "server/sim/bodies/piece_ref.h"
#include "server/sim/bodies/soft_body.h"

#include <span>

namespace crumple::sim {

// A piece of a finite-element body: a mesh of the world's, or a rigid fragment of one.
struct Piece {
  int soft = 0;       // into World::Impl::soft
  int fragment = -1;  // of its fragments; -1: the mesh itself
  bool is_rigid() const { return fragment >= 0; }
};

// All pieces of a finite-element body as they are now. Borrowed.
struct SoftShape {
  std::span<const Piece> pieces;
  std::span<const SoftBody> soft;
  std::span<const TetRef> scene_tets;  // where each tet of the scene's mesh is

  const SoftBody& mesh_of(int piece) const { return soft[pieces[piece].soft]; }
  const RigidFragment& fragment(int piece) const { return mesh_of(piece).fragments[pieces[piece].fragment]; }
  bool is_rigid(int piece) const { return pieces[piece].is_rigid(); }
  const contact::CollisionMesh& collision(int piece) const { return is_rigid(piece) ? fragment(piece).mesh() : mesh_of(piece).collision; }
  std::span<const Vec3> x(int piece) const {  // [m]
    return is_rigid(piece) ? std::span(fragment(piece).x()) : std::span(mesh_of(piece).state.x);
  }
  const Tet& nodes(TetRef at) const {
    return is_rigid(at.piece) ? fragment(at.piece).piece().tets[at.tet] : mesh_of(at.piece).tets[at.tet];
  }
  const Vec3& position(NodeRef at) const { return x(at.piece)[at.node]; }
  Vec3 velocity(NodeRef at) const {  // [m/s]
    return is_rigid(at.piece) ? fragment(at.piece).node_velocity(at.node) : mesh_of(at.piece).state.v[at.node];
  }
  std::uint16_t material_id(TetRef at) const {  // 0 in a body of one material
    const auto& ids = is_rigid(at.piece) ? fragment(at.piece).piece().material_id : mesh_of(at.piece).rest.material_id;
    return ids.empty() ? 0 : ids[at.tet];
  }
  Mat3 plastic_strain(TetRef at) const {
    if (is_rigid(at.piece)) return fragment(at.piece).piece().plastic_strain[at.tet];
    const SoftBody& mesh = mesh_of(at.piece);
    return fem::element_plastic_strain(mesh.rest, mesh.state.plastic_strain, at.tet);
  }
};

}  // namespace crumple::sim
