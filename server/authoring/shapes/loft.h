#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <vector>

namespace crumple::authoring {

// A section of a loft, perpendicular to its axis. Axis x: width along z, height along y; axis y: width along x, height
// along z; axis z: width along x, height along y.
struct LoftStation {
  Vec3 centre = Vec3::Zero();      // [m]
  double width = 1, height = 1;    // [m]
};

// Hulls, wings, masts: superellipses |2a / width|^p + |2b / height|^p = 1 on a row of stations, and flat ends.
struct Loft {
  int axis = 0;                       // 0: x, 1: y, 2: z
  std::vector<LoftStation> stations;  // two at least, ascending along the axis
  int sides = 16;                     // three at least
  double power = 2;                   // p: 1 a rhomb, 2 an ellipse, large a box
};

// Closed and outward: 2 sides stations.size() triangles.
sim::SurfaceMesh loft_surface(const Loft& loft);

}  // namespace crumple::authoring
