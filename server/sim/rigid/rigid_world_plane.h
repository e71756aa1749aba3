#pragma once

#include <btBulletCollisionCommon.h>

// Private to rigid_world: contact of a plane with what is made of vertices, or round.
namespace crumple::sim::bullet {

// Puts algorithms for box, hull, sphere, cylinder and moving triangle meshes against a plane into a dispatcher.
// Bullet's own finds one vertex of a hull a step and rocks the body to find others, and forgets a mesh's contacts every
// step; this one looks at every vertex that is near the plane: up to four are contacts, so a box rests on its corners from
// the first step on; of more, four are chosen and kept. The factory must outlive the dispatcher's use.
class PlaneContactFactory {
 public:
  void register_with(btCollisionDispatcher& dispatcher);

 private:
  struct Create : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };
  Create convex_first_, plane_first_;
};

}  // namespace crumple::sim::bullet
