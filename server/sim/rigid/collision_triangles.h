#pragma once

#include "common/types.h"
#include "server/sim/mesh/surface_mesh.h"

#include <cstdint>
#include <vector>

// What collision needs to know of a triangle mesh: which triangles are sound, and which of their edges stick out.
namespace crumple::sim {

// Triangles that have an area and a direction: drops repeated vertices, duplicates (same three positions), and needles
// of height below 1e-6 of their longest edge (STABILITY row 35). In mesh order.
std::vector<Triangle> sound_triangles(const SurfaceMesh& mesh);

// An edge that lies flat or in a notch between two triangles can never be what a body touches first; contact normals
// that point sideways there are bumps of the tessellation (STABILITY row 37). Edge k runs from corner k to k + 1.
class EdgeShape {
 public:
  EdgeShape() = default;
  EdgeShape(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

  // Whether point p of triangle t is on an edge that sticks out on the side n points to.
  bool on_ridge(int t, const Vec3& p, const Vec3& n) const;
  int triangle_count() const { return static_cast<int>(triangles_.size()); }

 private:
  struct Face {
    Vec3 corner[3];
    Vec3 normal;
    bool ridge[2][3];  // [front or back][edge]: sticks out, or is a border
  };
  std::vector<Face> triangles_;
};

}  // namespace crumple::sim
