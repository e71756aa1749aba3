#pragma once

#include "common/frame.h"
#include "server/sim/bodies/piece_ref.h"
#include "server/sim/bodies/rigid_fragment.h"
#include "server/sim/mesh/splinter_embedding.h"
#include "server/sim/scene.h"

#include <optional>
#include <span>

namespace crumple::sim {

// A body's parts as its skin sees them. Borrowed.
struct SoftShape {
  std::span<const Tet> tets;
  std::span<const Vec3> x;  // [m]
  const contact::CollisionMesh& mesh;
  std::span<const RigidFragment> fragments;
  std::span<const TetRef> scene_tets;  // where each tet of the scene's mesh is

  const Tet& nodes(TetRef at) const { return at.fragment < 0 ? tets[at.tet] : fragments[at.fragment].piece().tets[at.tet]; }
  const Vec3& position(NodeRef at) const { return at.fragment < 0 ? x[at.node] : fragments[at.fragment].x()[at.node]; }
};

// What is drawn of a finite-element body: its splinters, a surface that its tets carry, or the tets' own surface.
class SoftSkin {
 public:
  SoftSkin() = default;
  // A body that may break and has no splinters shows its tets: a surface in one piece would be drawn out between its parts.
  // INVALID, with field `splinters`, as SplinterEmbedding::make.
  static Result<SoftSkin> make(const FemModel& model, bool breakable, const SharedFaces& faces);

  // What is drawn after faces have parted; also to begin with. parted: see SplinterEmbedding::follow.
  void rebuild(const SoftShape& shape, const SharedFaces& faces, std::span<const int> parted);
  // Nodes of the body have other places: moved[node of before].
  void follow(std::span<const NodeRef> moved);

  const std::vector<Triangle>& triangles() const { return triangles_; }
  // Appends positions, and values if given: one a node of the body, [0, 1]; fragments have 0.
  void capture(const SoftShape& shape, const std::vector<float>* node_values, BodyFrame& frame) const;

 private:
  void draw_tets(const SoftShape& shape);
  void draw_splinters();

  std::shared_ptr<const SplinterMesh> splinters_;
  std::optional<SplinterEmbedding> carried_;
  bool draws_tets_ = false;
  std::vector<Triangle> triangles_;  // of what is drawn, which are nodes or
  std::vector<NodeRef> nodes_;
  Embedding embedding_;              // points in tets of the scene's mesh
};

}  // namespace crumple::sim
