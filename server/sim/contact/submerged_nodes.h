#pragma once

#include "server/sim/contact/collision_mesh.h"

#include <span>
#include <vector>

// Where a body meets a half-space: node by node.
namespace crumple::sim::contact {

struct SubmergedNode {
  int node;
  double depth;  // below the plane [m], > 0
  double area;   // [m^2], > 0: a third of each surface triangle of the node that faces the plane, seen along the normal;
                 // of a node without such a triangle (inside, or on top of what has sunk) V^(2/3), V a quarter of its tets
};

// Nodes of tets (a component) where normal . x < offset, ascending; |normal| = 1. Flat tets count for nothing.
// Until the thread's next call.
std::span<const SubmergedNode> submerged_nodes(std::span<const CollisionTet> tets, std::span<const Vec3> x, const Vec3& normal,
                                               double offset);

}  // namespace crumple::sim::contact
