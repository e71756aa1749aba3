#pragma once

#include "server/authoring/surface_distance.h"

#include <span>

namespace crumple::authoring {

// Carries what a surface's vertices have to points off it: each point takes what its nearest point of the surface has,
// interpolated in that triangle.
class SurfaceTransfer {
 public:
  // At least one triangle. points: P [m]. `surface` is kept by reference.
  SurfaceTransfer(const sim::SurfaceMesh& surface, std::span<const Vec3> points);

  // values: one column a vertex. Returns one column a point.
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& values) const;

 private:
  const sim::SurfaceMesh& surface_;
  std::vector<int> triangle_;  // nearest, one a point
  std::vector<Vec3> share_;    // barycentric
};

// Barycentric coordinates of a point in the plane of a triangle; a degenerate triangle's nearest corner has all.
Vec3 barycentric(const Vec3& p, const std::array<Vec3, 3>& corners);

}  // namespace crumple::authoring
