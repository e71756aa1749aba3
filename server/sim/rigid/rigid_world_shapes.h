#pragma once

#include <btBulletCollisionCommon.h>

#include <memory>
#include <vector>

#include "server/sim/rigid/collision_triangles.h"
#include "server/sim/rigid/rigid_world.h"

// Private to rigid_world: our shapes as Bullet's.
namespace crumple::sim::bullet {

inline btVector3 to_bullet(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btTransform to_bullet(const Quat& R, const Vec3& p) {
  return btTransform(btQuaternion(R.x(), R.y(), R.z(), R.w()), to_bullet(p));
}

// A Bullet collision shape with everything it points to.
class CollisionShape {
 public:
  CollisionShape() = default;
  CollisionShape(const CollisionShape&) = delete;
  CollisionShape& operator=(const CollisionShape&) = delete;

  btCollisionShape* root() const { return root_; }
  // Radius of a ball that fits in about the middle: half the smallest extent of the bounding box [m].
  double inner_radius() const;

 private:
  friend std::unique_ptr<CollisionShape> moving_shape(const std::vector<PlacedShape>&, const Pose&);
  friend std::unique_ptr<CollisionShape> fixed_shape(const Shape&);
  friend std::unique_ptr<CollisionShape> deformable_shape(const DeformableShape&, const Pose&);

  struct Triangles;
  template <class T>
  T* own(std::unique_ptr<T> shape);
  btCollisionShape* add_simple(const Shape& shape);
  btCollisionShape* add_hull(const std::vector<Vec3>& points);
  btCollisionShape* add_moving_triangles(const SurfaceMesh& mesh);
  btCollisionShape* add_fixed_triangles(const SurfaceMesh& mesh);

  // Destroyed last to first: compounds before their children, shapes before their triangles.
  struct TrianglesDeleter {
    void operator()(Triangles*) const;
  };
  std::vector<std::unique_ptr<Triangles, TrianglesDeleter>> triangles_;
  std::unique_ptr<EdgeShape> edges_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  btCollisionShape* root_ = nullptr;
};

// One shape for a body that moves freely, about the origin of its principal axes P; X_PB places the body's axes there.
// Hulls have a margin (their skin) of 0.5 % of their smallest extent, at most 1 mm.
std::unique_ptr<CollisionShape> moving_shape(const std::vector<PlacedShape>& shapes, const Pose& X_PB);
// One shape of a fixed or kinematic body, in the shape's own axes: Bullet's planes and triangle trees are not allowed
// in compounds, so each gets its own collision object.
std::unique_ptr<CollisionShape> fixed_shape(const Shape& shape);
std::unique_ptr<CollisionShape> deformable_shape(const DeformableShape& shape, const Pose& X_PB);

}  // namespace crumple::sim::bullet
