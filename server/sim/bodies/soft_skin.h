#pragma once

#include "common/frame.h"
#include "server/sim/bodies/soft_shape.h"
#include "server/sim/mesh/splinter_embedding.h"
#include "server/sim/scene.h"

#include <optional>
#include <span>

namespace crumple::sim {

// What is drawn of a finite-element body: its splinters, a surface that its tets carry, or the tets' own surface.
class SoftSkin {
 public:
  SoftSkin() = default;
  // A body that may break and has no splinters shows its tets: a surface in one piece would be drawn out between its parts.
  // INVALID, with field `splinters`, as SplinterEmbedding::make.
  static Result<SoftSkin> make(const FemModel& model, bool breakable, const SharedFaces& faces);

  // What is drawn after faces have parted; also to begin with. parted: see SplinterEmbedding::follow.
  void rebuild(const SoftShape& shape, const SharedFaces& faces, std::span<const int> parted);
  // Nodes of one piece are elsewhere: moved, one of each, says where.
  void follow(int piece, std::span<const NodeRef> moved);

  const std::vector<Triangle>& triangles() const { return triangles_; }
  // Appends positions and, if given, values: by piece one a node, [0, 1]; a piece without has 0.
  void capture(const SoftShape& shape, std::span<const std::vector<float>> node_values, BodyFrame& frame) const;

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
