#include "server/sim/rigid/rigid_world_dynamics.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>

#include <algorithm>

namespace crumple::sim::bullet {
Parts::Parts() : dispatcher(&configuration) {
  btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
  plane_contacts.register_with(dispatcher);  // after GImpact, whose own for planes it replaces
  mesh_contacts.register_with(dispatcher);
  // Pairs whose faces do not meet vertex by vertex (cylinders, large hulls) look for up to three more points.
  configuration.setConvexConvexMultipointIterations(3, 3);
}

DynamicsWorld::DynamicsWorld(const btVector3& gravity, int iterations, double tolerance)
    : btDiscreteDynamicsWorld(&(Parts::dispatcher), &(Parts::broadphase), &(Parts::solver), &(Parts::configuration)) {
  setGravity(gravity);
  btContactSolverInfo& info = getSolverInfo();
  info.m_numIterations = iterations;
  info.m_leastSquaresResidualThreshold = tolerance * tolerance;
  info.m_solverMode =
      SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
  info.m_restitutionVelocityThreshold = 1e30;  // rebounds are ContactSolver's
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0;  // no overlap is repaired through velocities
  info.m_erp2 = 0.2;
  info.m_linearSlop = 0;
  info.m_warmstartingFactor = 1;
  info.m_minimumSolverBatchSize = 1;  // one island, one solve: its bits do not depend on other islands
  getDispatchInfo().m_deterministicOverlappingPairs = true;
}

void DynamicsWorld::detect(double h) {
  // Bounces below twice what a body gains in one substep are noise of resting contact.
  Parts::solver.set_rebound_speed(std::max(2 * getGravity().length() * h, 0.01));
  predictUnconstraintMotion(h);
  getDispatchInfo().m_timeStep = h;
  createPredictiveContacts(h);
  performDiscreteCollisionDetection();
}

void DynamicsWorld::solve(double h) {
  calculateSimulationIslands();
  getSolverInfo().m_timeStep = h;
  Parts::solver.begin();
  solveConstraints(getSolverInfo());
}

void DynamicsWorld::forget_contacts(btCollisionObject& object) {
  releasePredictiveContacts();
  getPairCache()->cleanProxyFromPairs(object.getBroadphaseHandle(), getDispatcher());
}

}  // namespace crumple::sim::bullet
