#pragma once

#include <btBulletDynamicsCommon.h>

#include <utility>
#include <vector>

// Private to rigid_world: the contact law of rigid_world.h, on Bullet's sequential impulse solver.
namespace crumple::sim::bullet {

// What a collision object's user pointer points to.
struct ContactBody {
  unsigned id = 0;
  double friction = 0;
  double restitution = 0;
  // Of the current substep: the earliest rebound the body took part in, in (-h, h] from the substep's start [s]
  // (negative: it should have happened in the substep before).
  bool rebounds = false;
  double rebound_time = 0;
};

inline ContactBody* contact_body(const btCollisionObject* object) {
  return static_cast<ContactBody*>(object->getUserPointer());
}

class ContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  // Approach below this speed does not rebound [m/s].
  void set_rebound_speed(double speed) { rebound_speed_ = speed; }

  // Since the last `begin`: sweeps forth and back, and the largest change of a relative velocity in an island's last one [m/s].
  void begin() { sweeps_ = 0, residual_ = 0; }
  int sweeps() const { return sweeps_; }
  double residual() const { return residual_; }

 private:
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds, int manifold_count,
                      btTypedConstraint** constraints, int constraint_count, const btContactSolverInfo& info,
                      btIDebugDraw* debug, btDispatcher* dispatcher) override;
  btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                                        int manifold_count, btTypedConstraint** constraints, int constraint_count,
                                        const btContactSolverInfo& info, btIDebugDraw* debug) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count, btTypedConstraint** constraints,
                                int constraint_count, const btContactSolverInfo& info, btIDebugDraw* debug) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                         const btContactSolverInfo& info) override;

  void set_rebound(int contact, double h);
  void accelerate();
  template <class Visit>
  void for_rows(const Visit& visit);
  void apply(btSolverConstraint& row, double impulse);
  double solve_row(btSolverConstraint& row);
  double moved(const btSolverConstraint& row);
  double slip(const btSolverConstraint& row);
  double solve_friction(const btSolverConstraint& contact);

  struct Rebound {
    int contact;
    double time;
  };
  std::vector<Rebound> rebounds_;  // of the current island
  std::vector<std::pair<btPersistentManifold*, int>> manifold_order_;  // scratch
  std::vector<std::pair<btTypedConstraint*, int>> constraint_order_;
  double rebound_speed_ = 0;
  int sweeps_ = 0;
  double residual_ = 0;
  // Of the conjugate directions, one a row.
  std::vector<double> last_, direction_;
  double last_progress_ = 0;
};

}  // namespace crumple::sim::bullet
