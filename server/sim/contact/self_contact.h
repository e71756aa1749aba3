#pragma once

#include "server/sim/contact/collision_mesh.h"

#include <vector>

// Which tets of one face-connected piece may meet each other. What is near at rest overlaps when it is squeezed or turns
// inside out, which is for elasticity to undo: "false collisions that occur due to mesh adjacencies"
// [Parker & O'Brien 2009, section 6].
namespace crumple::sim::contact {

// About a tet at rest.
struct RestBall {
  Vec3 centre;    // mean of its nodes, in the body's axes [m]
  double radius;  // to the farthest of them [m]
};

// Whether two tets of a piece never meet: unless their centres are more than twice as far apart at rest as for balls
// that touch. (Tets that share a node are near.) A slit that is narrower is not seen closing.
bool near_at_rest(const RestBall& a, const RestBall& b);

// Boundary tets of a piece that lie together at rest.
struct SurfacePatch {
  int begin, end;      // in SelfContact::tets
  RestBall ball;       // about the centres of its tets
  double tet_radius;   // the least of its tets [m]
};

// Whether no tet of one may meet one of the other.
bool near_at_rest(const SurfacePatch& a, const SurfacePatch& b);

// Made with the collision mesh, of a body that asks for it.
struct SelfContact {
  std::vector<RestBall> balls;        // one a tet of CollisionMesh::tets
  std::vector<int> tets;              // boundary tets, in CollisionMesh::tets; by patch, ascending within it
  std::vector<SurfacePatch> patches;  // by component
  std::vector<int> first_patch;       // one a component, and one more
};

// X: rest positions of the mesh that `collision` was made of.
SelfContact make_self_contact(const CollisionMesh& collision, const std::vector<Vec3>& X);

}  // namespace crumple::sim::contact
