#pragma once

#include "server/sim/contact/self_contact.h"
#include "server/sim/contact/sweep_and_prune.h"
#include "server/sim/contact/tet_overlap.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::test {

// Volume that tets of a piece share at x with others that are not near them at rest, as part of the volume of all [-].
inline double self_overlap(const sim::TetMesh& mesh, const std::vector<Vec3>& x) {
  using namespace sim::contact;
  const CollisionMesh collision = make_collision_mesh(mesh.tets, mesh.X, {});
  const SelfContact self = make_self_contact(collision, mesh.X);
  std::vector<OrientedTet> shapes;
  std::vector<Box3> boxes;
  double common = 0, all = 0;
  for (const CollisionTet& tet : collision.tets) {
    Mat34 corners;
    for (int k = 0; k < 4; ++k) corners.col(k) = x[tet.nodes[k]];
    shapes.push_back(orient(corners));
    boxes.emplace_back(corners.rowwise().minCoeff(), corners.rowwise().maxCoeff());
    all += shapes.back().volume;
  }
  for (const auto& [i, j] : sweep_and_prune(boxes)) {
    const bool apart = !near_at_rest(self.balls[i], self.balls[j]);
    if (apart && shapes[i].volume > 0 && shapes[j].volume > 0) common += overlap(shapes[i], shapes[j]).volume;
  }
  return common / all;
}

}  // namespace crumple::test
