#pragma once

#include <btBulletDynamicsCommon.h>

#include "server/sim/rigid/rigid_world_contacts.h"
#include "server/sim/rigid/rigid_world_mesh.h"
#include "server/sim/rigid/rigid_world_plane.h"

// Private to rigid_world: Bullet's pipeline, cut at the places where rigid_world does its own part of a substep.
namespace crumple::sim::bullet {

// Everything Bullet's world is built from, in the order it must live.
struct Parts {
  Parts();
  btDefaultCollisionConfiguration configuration;
  PlaneContactFactory plane_contacts;
  MeshContactFactory mesh_contacts;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  ContactSolver solver;
};

// Detection and contact solve of one substep. Integration of poses is left to the caller: after solve(), Bullet's
// bodies have their new velocities and poses moved by nothing but the repair of overlaps.
class DynamicsWorld : private Parts, public btDiscreteDynamicsWorld {
 public:
  DynamicsWorld(const btVector3& gravity, int iterations, double tolerance);

  void detect(double h);
  const ContactSolver& contact_solver() const { return Parts::solver; }  // as solve() left it
  void solve(double h);
  // Forgets all contacts of an object, after its shape or pose was changed from outside.
  void forget_contacts(btCollisionObject& object);

  int manifold_count() const { return Parts::dispatcher.getNumManifolds(); }
  btPersistentManifold& manifold(int i) { return *Parts::dispatcher.getManifoldByIndexInternal(i); }
  const btPersistentManifold& manifold(int i) const { return *Parts::dispatcher.getManifoldByIndexInternal(i); }
};

}  // namespace crumple::sim::bullet
