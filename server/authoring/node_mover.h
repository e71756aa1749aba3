#pragma once

#include "server/sim/mesh/node_stars.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::authoring {

// Moves nodes of a tet mesh as far as every tet around them keeps a volume. Topology stays.
class NodeMover {
 public:
  NodeMover(sim::TetMesh& mesh, double least_volume)  // [m^3]; borrowed
      : mesh_(mesh), stars_(mesh.tets, mesh.node_count()), least_(least_volume) {}

  void move(int node, const Vec3& target);                            // as many quarters of the way as go
  bool try_move(int node, const Vec3& target);                        // all of it, or not at all
  std::span<const int> star(int node) const { return stars_[node]; }  // the tets around it

 private:
  bool allowed(int node) const;

  sim::TetMesh& mesh_;
  sim::NodeStars stars_;
  double least_;
};

}  // namespace crumple::authoring
