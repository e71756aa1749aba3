#pragma once

#include <btBulletCollisionCommon.h>

// Private to rigid_world: contact of a convex shape with a fixed or kinematic triangle mesh.
namespace crumple::sim::bullet {

// Puts algorithms for box, hull, sphere and cylinder against btBvhTriangleMeshShape (whose user pointer is its
// EdgeShape) into a dispatcher. Bullet's own gives each triangle the one point that is nearest, which over a flat floor
// is any point at all, and at the floor's inner edges may point sideways. Here faces are felt by support_points, and
// Bullet's points count only on edges that stick out. The factory must outlive the dispatcher's use.
class MeshContactFactory {
 public:
  void register_with(btCollisionDispatcher& dispatcher);

 private:
  struct Create : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };
  Create convex_first_, mesh_first_;
};

}  // namespace crumple::sim::bullet
