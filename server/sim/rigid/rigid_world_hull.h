#pragma once

#include <btBulletCollisionCommon.h>

#include "server/sim/mesh/surface_mesh.h"

// Private to rigid_world.
namespace crumple::sim::bullet {

// What Bullet is told a Hull is: with this type it asks the shape for its support, and does not look for it itself.
inline constexpr BroadphaseNativeTypes kHullType = CUSTOM_POLYHEDRAL_SHAPE_TYPE;

// A convex hull whose support and faces are ours. Bullet looks for the support by a chain of comparisons, one point after
// the other; here points stand as three arrays, which the vector unit takes four at a time. Bullet's way to the faces
// finds the hull again and compares all triangles with all.
class Hull : public btConvexHullShape {
 public:
  explicit Hull(const std::vector<Vec3>& points);  // one at least
  void set_faces(const SurfaceMesh& hull);         // its vertices are the points

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 3> points_;  // padded by its first to whole blocks
};

}  // namespace crumple::sim::bullet
