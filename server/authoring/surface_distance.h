#pragma once

#include "server/authoring/triangle_bvh.h"

namespace crumple::authoring {

// Point of a triangle nearest to p [m]; a degenerate triangle counts as its edges.
Vec3 nearest_point_on_triangle(const Vec3& p, const std::array<Vec3, 3>& corners);

// Unsigned distance to a triangle surface by a tree of boxes.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const sim::SurfaceMesh& surface);  // at least one triangle

  struct Nearest {
    Vec3 point;       // [m]
    int triangle;     // id in the surface
    double distance;  // [m]
  };
  Nearest nearest(const Vec3& p) const;
  double operator()(const Vec3& p) const { return nearest(p).distance; }

 private:
  TriangleBvh tree_;
};

}  // namespace crumple::authoring
