#include "server/sim/rigid/rigid_world_contacts.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace crumple::sim::bullet {
namespace {

// An order that depends on the manifold's own content only, so that an island's bits do not depend on other islands.
auto order_key(const btPersistentManifold* manifold) {
  const btVector3 p = manifold->getNumContacts() ? manifold->getContactPoint(0).m_localPointA : btVector3(0, 0, 0);
  return std::tuple(contact_body(manifold->getBody0())->id, contact_body(manifold->getBody1())->id, p.x(), p.y(),
                    p.z());
}

}  // namespace

btScalar ContactSolver::solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                                   int manifold_count, btTypedConstraint** constraints, int constraint_count,
                                   const btContactSolverInfo& info, btIDebugDraw* debug, btDispatcher* dispatcher) {
  std::stable_sort(manifolds, manifolds + manifold_count,
                   [](const auto* a, const auto* b) { return order_key(a) < order_key(b); });
  std::stable_sort(constraints, constraints + constraint_count,
                   [](const auto* a, const auto* b) { return a->getUserConstraintId() < b->getUserConstraintId(); });
  return btSequentialImpulseConstraintSolver::solveGroup(bodies, body_count, manifolds, manifold_count, constraints,
                                                         constraint_count, info, debug, dispatcher);
}

btScalar ContactSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                                     btPersistentManifold** manifolds, int manifold_count,
                                                     btTypedConstraint** constraints, int constraint_count,
                                                     const btContactSolverInfo& info, btIDebugDraw* debug) {
  btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySetup(bodies, body_count, manifolds, manifold_count,
                                                                    constraints, constraint_count, info, debug);
  rebounds_.clear();
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) set_rebound(i, info.m_timeStep);
  return 0;
}

// Bullet has set the row to v+ >= -max(d, 0)/h without restitution. Gravity's part g_n of the approach makes the speed
// of a fall depend on where in the substep one looks: v is the speed in the middle (the velocity after gravity moves
// the body through the whole substep), the speed at the time t of the hit is v + g_n (t - h/2), and what leaves there
// with e times that is, seen from the middle, e |v_hit| + g_n (h/2 - t).
void ContactSolver::set_rebound(int contact, double h) {
  btSolverConstraint& row = m_tmpSolverContactConstraintPool[contact];
  row.m_upperLimit = 1e30;
  const auto& point = *static_cast<const btManifoldPoint*>(row.m_originalContactPoint);
  const btSolverBody& A = m_tmpSolverBodyPool[row.m_solverBodyIdA];
  const btSolverBody& B = m_tmpSolverBodyPool[row.m_solverBodyIdB];
  const double before =
      row.m_contactNormal1.dot(A.m_linearVelocity) + row.m_relpos1CrossNormal.dot(A.m_angularVelocity) +
      row.m_contactNormal2.dot(B.m_linearVelocity) + row.m_relpos2CrossNormal.dot(B.m_angularVelocity);
  const double gained =
      row.m_contactNormal1.dot(A.m_externalForceImpulse) + row.m_contactNormal2.dot(B.m_externalForceImpulse);
  const double v = before + gained, gap = point.getDistance(), e = point.m_combinedRestitution;
  if (e <= 0 || v >= 0 || gap + v * h > 0) return;

  const double t = std::clamp(gap / -v, -h, h);
  const double hit = v + gained * (t / h - 0.5);
  if (hit > -rebound_speed_) return;
  const double leaving = std::max(0.0, -e * hit + gained * (0.5 - t / h));
  row.m_rhs = (leaving - v) * row.m_jacDiagABInv;
  row.m_rhsPenetration = 0;
  rebounds_.push_back({contact, t});
}

// All joints and normals, then the friction of all contacts: Gauss-Seidel sweeps as Bullet's, but with a round friction cone, and
// each forth and back (a stack of ten rests in 30 of them and topples slowly in 100 that only go forth), with conjugate
// directions in between.
btScalar ContactSolver::solveSingleIteration(int iteration, btCollisionObject**, int, btPersistentManifold**, int,
                                             btTypedConstraint**, int, const btContactSolverInfo& info, btIDebugDraw*) {
  auto& contacts = m_tmpSolverContactConstraintPool;
  auto& frictions = m_tmpSolverContactFrictionConstraintPool;
  auto& joints = m_tmpSolverNonContactConstraintPool;
  if (iteration == 0) {
    last_.resize(contacts.size() + frictions.size() + joints.size());
    for (std::size_t i = 0; i < last_.size(); ++i) last_[i] = row(static_cast<int>(i)).m_appliedImpulse;
    direction_.assign(last_.size(), 0);
    last_progress_ = 0;
  }
  double worst = 0;  // change of a relative velocity [m/s]
  const auto solve_normal = [&](btSolverConstraint& row) {
    const double change = resolveSingleConstraintRowLowerLimit(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                                               m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
    worst = std::max(worst, std::abs(change));
  };
  const auto solve_joint = [&](btSolverConstraint& row) {
    const double change = resolveSingleConstraintRowGeneric(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                                            m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
    worst = std::max(worst, std::abs(change));
  };
  for (int i = 0; i < joints.size(); ++i) solve_joint(joints[i]);
  for (int i = 0; i < contacts.size(); ++i) solve_normal(contacts[i]);
  for (int i = 0; i < contacts.size(); ++i) worst = std::max(worst, solve_friction(contacts[i]));
  for (int i = contacts.size() - 1; i >= 0; --i) worst = std::max(worst, solve_friction(contacts[i]));
  for (int i = contacts.size() - 1; i >= 0; --i) solve_normal(contacts[i]);
  for (int i = joints.size() - 1; i >= 0; --i) solve_joint(joints[i]);
  const bool is_last = iteration + 1 >= info.m_numIterations || worst * worst <= info.m_leastSquaresResidualThreshold;
  if (!is_last) accelerate();  // what it overshoots, the next sweep projects back
  return worst * worst;
}

// Normals, then friction, then joints.
btSolverConstraint& ContactSolver::row(int i) {
  for (btConstraintArray* rows : {&m_tmpSolverContactConstraintPool, &m_tmpSolverContactFrictionConstraintPool}) {
    if (i < rows->size()) return (*rows)[i];
    i -= rows->size();
  }
  return m_tmpSolverNonContactConstraintPool[i];
}

// Nonsmooth nonlinear conjugate gradients (Silcowitz-Hansen, Niebe, Erleben 2010, algorithm 1): the step s of a sweep
// serves as minus the gradient, beta = |s|^2 / |s_last|^2, restart where beta > 1. Norms in the energy metric.
void ContactSolver::accelerate() {
  const int rows = static_cast<int>(last_.size());
  double progress = 0;
  for (int i = 0; i < rows; ++i) {
    const double step = row(i).m_appliedImpulse - last_[i];
    progress += step * step / row(i).m_jacDiagABInv;
  }
  const double beta = last_progress_ > 0 && progress < last_progress_ ? progress / last_progress_ : 0;
  last_progress_ = progress;
  for (int i = 0; i < rows; ++i) {
    btSolverConstraint& r = row(i);
    const double extra = beta * direction_[i];
    direction_[i] = extra + r.m_appliedImpulse - last_[i];
    if (extra != 0) {
      btSolverBody& A = m_tmpSolverBodyPool[r.m_solverBodyIdA];
      btSolverBody& B = m_tmpSolverBodyPool[r.m_solverBodyIdB];
      A.internalApplyImpulse(r.m_contactNormal1 * A.internalGetInvMass(), r.m_angularComponentA, extra);
      B.internalApplyImpulse(r.m_contactNormal2 * B.internalGetInvMass(), r.m_angularComponentB, extra);
      r.m_appliedImpulse += extra;
    }
    last_[i] = r.m_appliedImpulse;
  }
}

// Velocity along a row that the impulses applied so far have left [m/s].
double ContactSolver::slip(const btSolverConstraint& row) {
  const btSolverBody& A = m_tmpSolverBodyPool[row.m_solverBodyIdA];
  const btSolverBody& B = m_tmpSolverBodyPool[row.m_solverBodyIdB];
  return row.m_contactNormal1.dot(A.m_deltaLinearVelocity) + row.m_relpos1CrossNormal.dot(A.m_deltaAngularVelocity) +
         row.m_contactNormal2.dot(B.m_deltaLinearVelocity) + row.m_relpos2CrossNormal.dot(B.m_deltaAngularVelocity) -
         row.m_rhs / row.m_jacDiagABInv;
}

// Sticks if it can. If not, f <- projection of f - d slip onto the disc |f| <= mu N, with one step length d for both
// directions: only then does the friction that stays put point against the slip.
double ContactSolver::solve_friction(const btSolverConstraint& contact) {
  btSolverConstraint& r1 = m_tmpSolverContactFrictionConstraintPool[contact.m_frictionIndex];
  btSolverConstraint& r2 = m_tmpSolverContactFrictionConstraintPool[contact.m_frictionIndex + 1];
  const double old1 = r1.m_appliedImpulse, old2 = r2.m_appliedImpulse;
  const double limit = contact.m_friction * contact.m_appliedImpulse;
  if (limit <= 0 && old1 == 0 && old2 == 0) return 0;
  const auto solve = [&](btSolverConstraint& row, double low, double high) {
    row.m_lowerLimit = low;
    row.m_upperLimit = high;
    resolveSingleConstraintRowGeneric(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                      m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
  };
  const double slip1 = slip(r1), slip2 = slip(r2);
  solve(r1, -1e30, 1e30);
  solve(r2, -1e30, 1e30);
  const double f1_stick = r1.m_appliedImpulse, f2_stick = r2.m_appliedImpulse;
  if (f1_stick * f1_stick + f2_stick * f2_stick > limit * limit) {
    const double d = std::min(r1.m_jacDiagABInv, r2.m_jacDiagABInv);
    double f1 = old1 - d * slip1, f2 = old2 - d * slip2;
    const double f = std::sqrt(f1 * f1 + f2 * f2);
    if (f > limit) f1 *= limit / f, f2 *= limit / f;
    solve(r1, f1, f1);
    solve(r2, f2, f2);
  }
  return std::max(std::abs(r1.m_appliedImpulse - old1) / r1.m_jacDiagABInv,
                  std::abs(r2.m_appliedImpulse - old2) / r2.m_jacDiagABInv);
}

btScalar ContactSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                                      const btContactSolverInfo& info) {
  for (const Rebound& rebound : rebounds_) {
    const btSolverConstraint& row = m_tmpSolverContactConstraintPool[rebound.contact];
    if (!(row.m_appliedImpulse > 0)) continue;
    for (const int side : {row.m_solverBodyIdA, row.m_solverBodyIdB}) {
      const btRigidBody* body = m_tmpSolverBodyPool[side].m_originalBody;
      if (!body) continue;
      ContactBody& state = *contact_body(body);
      if (!state.rebounds || rebound.time < state.rebound_time) state.rebound_time = rebound.time;
      state.rebounds = true;
    }
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, body_count, info);
}

}  // namespace crumple::sim::bullet
