#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <vector>

namespace crumple::sim {

// A face of a convex hull: its corners, counter-clockwise from outside, and its plane normal . x = offset.
struct HullFace {
  std::vector<int> corners;  // of the hull's vertices
  Vec3 normal = Vec3::Zero();
  double offset = 0;  // [m]; no vertex of the hull lies further out than this, but for the slack
};

// The triangles of a hull (convex_hull.h), those put together to polygons that turn by less than 2.6 degrees from the
// largest of them: a lid of a barrel is one face again, and rests on more than three points. Linear in the triangles,
// but for sorting. Triangles without an area belong to a neighbour's face or are left out.
std::vector<HullFace> hull_faces(const SurfaceMesh& hull);

}  // namespace crumple::sim
