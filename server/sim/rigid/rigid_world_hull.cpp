#include "server/sim/rigid/rigid_world_hull.h"

#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>

#include "server/sim/rigid/hull_faces.h"

namespace crumple::sim::bullet {
namespace {

constexpr int kBlock = 16;  // points looked at together

btVector3 to_bullet(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Hull::Hull(const std::vector<Vec3>& points) {
  m_shapeType = kHullType;
  const int count = static_cast<int>(points.size());
  points_.resize((count + kBlock - 1) / kBlock * kBlock, 3);
  for (int k = 0; k < points_.rows(); ++k) points_.row(k) = points[k < count ? k : 0].transpose();
  m_unscaledPoints.reserve(count);
  for (const Vec3& p : points) m_unscaledPoints.push_back(to_bullet(p));
}

void Hull::set_faces(const SurfaceMesh& hull) {
  m_polyhedron = new (btAlignedAlloc(sizeof(btConvexPolyhedron), 16)) btConvexPolyhedron;  // freed by its base
  for (const Vec3& p : hull.vertices) m_polyhedron->m_vertices.push_back(to_bullet(p));
  for (const HullFace& face : hull_faces(hull)) {
    btFace& added = m_polyhedron->m_faces.expand();
    for (int corner : face.corners) added.m_indices.push_back(corner);
    for (int k = 0; k < 3; ++k) added.m_plane[k] = face.normal[k];
    added.m_plane[3] = -face.offset;
  }
}

// The first of the farthest points.
btVector3 Hull::localGetSupportingVertexWithoutMargin(const btVector3& direction) const {
  const Vec3 n(direction.x(), direction.y(), direction.z());
  int block = 0;
  double farthest = -std::numeric_limits<double>::infinity();
  Eigen::Array<double, kBlock, 1> along, best;
  for (int k = 0; k < points_.rows(); k += kBlock) {
    along = points_.middleRows<kBlock>(k) * n;
    const double reach = along.maxCoeff();
    if (reach > farthest) {
      farthest = reach;
      block = k;
      best = along;
    }
  }
  int k = 0;
  while (k + 1 < kBlock && best[k] != farthest) ++k;
  return to_bullet(points_.row(block + k).transpose());
}

}  // namespace crumple::sim::bullet
