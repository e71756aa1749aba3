#include "server/authoring/surface_transfer.h"

#include <algorithm>

namespace crumple::authoring {

Vec3 barycentric(const Vec3& p, const std::array<Vec3, 3>& c) {
  const Vec3 normal = (c[1] - c[0]).cross(c[2] - c[0]);
  const double area2 = normal.squaredNorm();
  Vec3 share;
  for (int k = 0; k < 3; ++k) share[k] = (c[(k + 1) % 3] - p).cross(c[(k + 2) % 3] - p).dot(normal) / area2;
  if (share.allFinite()) return share;
  int nearest = 0;
  for (int k = 1; k < 3; ++k)
    if ((c[k] - p).squaredNorm() < (c[nearest] - p).squaredNorm()) nearest = k;
  return Vec3::Unit(nearest);
}

SurfaceTransfer::SurfaceTransfer(const sim::SurfaceMesh& surface, std::span<const Vec3> points) : surface_(surface) {
  const SurfaceDistance distance(surface);
  for (const Vec3& p : points) {
    const auto nearest = distance.nearest(p);
    const Triangle& t = surface.triangles[static_cast<std::size_t>(nearest.triangle)];
    triangle_.push_back(nearest.triangle);
    share_.push_back(
        barycentric(nearest.point, {surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]}));
  }
}

Eigen::MatrixXd SurfaceTransfer::operator()(const Eigen::MatrixXd& values) const {
  Eigen::MatrixXd out(values.rows(), static_cast<Eigen::Index>(triangle_.size()));
  for (std::size_t p = 0; p < triangle_.size(); ++p) {
    const Triangle& t = surface_.triangles[static_cast<std::size_t>(triangle_[p])];
    const auto column = static_cast<Eigen::Index>(p);
    out.col(column) =
        share_[p][0] * values.col(t[0]) + share_[p][1] * values.col(t[1]) + share_[p][2] * values.col(t[2]);
  }
  return out;
}

}  // namespace crumple::authoring
