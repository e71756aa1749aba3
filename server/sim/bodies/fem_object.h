#pragma once

#include "common/error.h"
#include "common/frame.h"
#include "server/sim/bodies/dust.h"
#include "server/sim/bodies/soft_body.h"
#include "server/sim/bodies/soft_shape.h"
#include "server/sim/bodies/soft_skin.h"
#include "server/sim/scene.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace crumple::sim {

// A finite-element body as the scene, its commands and its watchers know it: its look, and where the nodes and tets of the
// scene's mesh are now. What is stepped are its pieces: the mesh that it starts as and, as it breaks, those that leave, large
// ones as meshes of their own, small ones as rigid fragments of a mesh.
//
// soft: all of the world's meshes, in each function.
class FemObject {
 public:
  // first: the soft-th of the world's, whole. Errors are SoftSkin::make's.
  static Result<FemObject> make(const BodyDescription& body, const FemModel& model, int soft, const SoftBody& first);

  BodyId id() const { return id_; }
  std::span<const Piece> pieces() const { return pieces_; }
  int scene_node_count() const { return static_cast<int>(scene_nodes_.size()); }  // of the scene's mesh, which commands name
  int connected_pieces(std::span<const SoftBody> soft) const;  // face-connected, rigid ones included
  int rigid_pieces() const;
  SoftShape shape(std::span<const SoftBody> soft) const { return {pieces_, soft, scene_tets_}; }

  // `left` have left `from`, in the order of `moved`: they are pieces from now on.
  void follow(const SoftBody& from, const SoftBody::HandOver& moved, std::span<const Piece> left);
  // After splits, however many: the surface that is drawn, and the dust that leaves what is new of it.
  void draw(std::span<const SoftBody> soft);
  std::vector<DustParticle> take_dust(std::span<const SoftBody> soft, std::uint64_t seed, std::uint64_t step);

  // Spreads an impulse [N s] over the nodes within radius of a point by a smooth kernel times their mass; on the nearest
  // node if there is none.
  void push(std::span<SoftBody> soft, const Vec3& impulse_W, const Vec3& point_W, double radius) const;
  void push_nodes(std::span<SoftBody> soft, const Vec3& impulse_W, std::span<const int> nodes) const;  // shared by mass; ids of the scene's mesh

  double mass(std::span<const SoftBody> soft) const;  // [kg]
  Vec3 centre_of_mass(std::span<const SoftBody> soft) const;
  Vec3 momentum(std::span<const SoftBody> soft) const;

  BodyTopology topology(std::span<const SoftBody> soft) const;
  void capture(std::span<const SoftBody> soft, bool with_values, BodyFrame& frame) const;

 private:
  void for_each_mesh(std::span<const SoftBody> soft, auto&& look) const {
    for (const Piece& piece : pieces_)
      if (!piece.is_rigid()) look(soft[piece.soft]);
  }

  BodyId id_ = 0;
  std::string name_;
  std::array<float, 3> colour_;
  float opacity_ = 1;
  std::vector<Piece> pieces_;          // in the order in which they came to be
  std::vector<NodeRef> scene_nodes_;   // where each node of the scene's mesh is
  std::vector<TetRef> scene_tets_;     // likewise, each tet
  SharedFaces faces_;                  // of the scene's mesh; none unless the skin or dust asks for them
  std::vector<int> torn_;              // that have come apart since take_dust
  SoftSkin skin_;
};

}  // namespace crumple::sim
