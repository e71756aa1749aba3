#include "server/sim/rigid/rigid_world_contacts.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace crumple::sim::bullet {
namespace {

// An order that depends on the manifold's own content only, so that an island's bits do not depend on other islands.
auto order_key(const btPersistentManifold* manifold) {
  const btVector3 p = manifold->getNumContacts() ? manifold->getContactPoint(0).m_localPointA : btVector3(0, 0, 0);
  const auto ordered = [](btScalar s) { return std::isnan(s) ? 0 : s; };
  return std::tuple(contact_body(manifold->getBody0())->id, contact_body(manifold->getBody1())->id, ordered(p.x()), ordered(p.y()),
                    ordered(p.z()));
}

// A stable sort by less, in memory that is kept.
template <class Item, class Less>
void sort_in_order(Item** items, int count, std::vector<std::pair<Item*, int>>& scratch, Less less) {
  scratch.clear();
  for (int i = 0; i < count; ++i) scratch.emplace_back(items[i], i);
  std::ranges::sort(scratch, [&](const auto& a, const auto& b) {
    if (less(a.first, b.first)) return true;
    return !less(b.first, a.first) && a.second < b.second;
  });
  for (int i = 0; i < count; ++i) items[i] = scratch[i].first;
}

}  // namespace

btScalar ContactSolver::solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                                   int manifold_count, btTypedConstraint** constraints, int constraint_count,
                                   const btContactSolverInfo& info, btIDebugDraw* debug, btDispatcher* dispatcher) {
  sort_in_order(manifolds, manifold_count, manifold_order_, [](const auto* a, const auto* b) { return order_key(a) < order_key(b); });
  sort_in_order(constraints, constraint_count, constraint_order_,
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
    for_rows([&](const btSolverConstraint& row, std::size_t i) { last_[i] = row.m_appliedImpulse; });
    direction_.assign(last_.size(), 0);
    last_progress_ = 0;
  }
  double worst = 0;  // change of a relative velocity [m/s]
  const auto solve = [&](btSolverConstraint& row) { worst = std::max(worst, std::abs(solve_row(row))); };
  for (int i = 0; i < joints.size(); ++i) solve(joints[i]);
  for (int i = 0; i < contacts.size(); ++i) solve(contacts[i]);
  for (int i = 0; i < contacts.size(); ++i) worst = std::max(worst, solve_friction(contacts[i]));
  for (int i = contacts.size() - 1; i >= 0; --i) worst = std::max(worst, solve_friction(contacts[i]));
  for (int i = contacts.size() - 1; i >= 0; --i) solve(contacts[i]);
  for (int i = joints.size() - 1; i >= 0; --i) solve(joints[i]);
  const bool is_last = iteration + 1 >= info.m_numIterations || worst * worst <= info.m_leastSquaresResidualThreshold;
  ++sweeps_;
  if (is_last) residual_ = std::max(residual_, worst);
  else accelerate();  // what it overshoots, the next sweep projects back
  return worst * worst;
}

// Normals, then friction, then joints; visit(row, its place).
template <class Visit>
void ContactSolver::for_rows(const Visit& visit) {
  std::size_t place = 0;
  for (btConstraintArray* rows :
       {&m_tmpSolverContactConstraintPool, &m_tmpSolverContactFrictionConstraintPool, &m_tmpSolverNonContactConstraintPool})
    for (int i = 0; i < rows->size(); ++i) visit((*rows)[i], place++);
}

void ContactSolver::apply(btSolverConstraint& row, double impulse) {
  btSolverBody& A = m_tmpSolverBodyPool[row.m_solverBodyIdA];
  btSolverBody& B = m_tmpSolverBodyPool[row.m_solverBodyIdB];
  A.internalApplyImpulse(row.m_contactNormal1 * A.internalGetInvMass(), row.m_angularComponentA, impulse);
  B.internalApplyImpulse(row.m_contactNormal2 * B.internalGetInvMass(), row.m_angularComponentB, impulse);
}

// Projected Gauss-Seidel on one row. Returns by how much its velocity changed [m/s].
double ContactSolver::solve_row(btSolverConstraint& row) {
  const double old = row.m_appliedImpulse;
  const double wanted = old + row.m_rhs - row.m_cfm * old - moved(row) * row.m_jacDiagABInv;
  row.m_appliedImpulse = std::clamp<double>(wanted, row.m_lowerLimit, row.m_upperLimit);
  const double change = row.m_appliedImpulse - old;
  if (change != 0) apply(row, change);
  return change / row.m_jacDiagABInv;
}

// Nonsmooth nonlinear conjugate gradients (Silcowitz-Hansen, Niebe, Erleben 2010, algorithm 1): the step s of a sweep
// serves as minus the gradient, beta = |s|^2 / |s_last|^2, restart where beta > 1. Norms in the energy metric.
void ContactSolver::accelerate() {
  double progress = 0;
  for_rows([&](const btSolverConstraint& row, std::size_t i) {
    const double step = row.m_appliedImpulse - last_[i];
    progress += step * step / row.m_jacDiagABInv;
  });
  const double beta = last_progress_ > 0 && progress < last_progress_ ? progress / last_progress_ : 0;
  last_progress_ = progress;
  for_rows([&](btSolverConstraint& row, std::size_t i) {
    const double extra = beta * direction_[i];
    direction_[i] = extra + row.m_appliedImpulse - last_[i];
    if (extra != 0) {
      apply(row, extra);
      row.m_appliedImpulse += extra;
    }
    last_[i] = row.m_appliedImpulse;
  });
}

// Velocity along a row that the impulses applied so far have given [m/s].
double ContactSolver::moved(const btSolverConstraint& row) {
  const btSolverBody& A = m_tmpSolverBodyPool[row.m_solverBodyIdA];
  const btSolverBody& B = m_tmpSolverBodyPool[row.m_solverBodyIdB];
  return row.m_contactNormal1.dot(A.m_deltaLinearVelocity) + row.m_relpos1CrossNormal.dot(A.m_deltaAngularVelocity) +
         row.m_contactNormal2.dot(B.m_deltaLinearVelocity) + row.m_relpos2CrossNormal.dot(B.m_deltaAngularVelocity);
}

// And what they have left of it [m/s].
double ContactSolver::slip(const btSolverConstraint& row) { return moved(row) - row.m_rhs / row.m_jacDiagABInv; }

// Sticks if it can. If not, f <- projection of f - d slip onto the disc |f| <= mu N, with one step length d for both
// directions: only then does the friction that stays put point against the slip.
double ContactSolver::solve_friction(const btSolverConstraint& contact) {
  btSolverConstraint& r1 = m_tmpSolverContactFrictionConstraintPool[contact.m_frictionIndex];
  btSolverConstraint& r2 = m_tmpSolverContactFrictionConstraintPool[contact.m_frictionIndex + 1];
  const double old1 = r1.m_appliedImpulse, old2 = r2.m_appliedImpulse;
  const double limit = contact.m_friction * contact.m_appliedImpulse;
  if (limit <= 0 && old1 == 0 && old2 == 0) return 0;
  const auto set = [&](btSolverConstraint& row, double f) {
    apply(row, f - row.m_appliedImpulse);
    row.m_appliedImpulse = f;
  };
  const double slip1 = slip(r1), slip2 = slip(r2);
  const double f1_stick = old1 - slip1 * r1.m_jacDiagABInv;
  set(r1, f1_stick);
  const double f2_stick = old2 - slip(r2) * r2.m_jacDiagABInv;
  set(r2, f2_stick);
  if (f1_stick * f1_stick + f2_stick * f2_stick > limit * limit) {
    const double d = std::min(r1.m_jacDiagABInv, r2.m_jacDiagABInv);
    double f1 = old1 - d * slip1, f2 = old2 - d * slip2;
    const double f = std::sqrt(f1 * f1 + f2 * f2);
    if (f > limit) f1 *= limit / f, f2 *= limit / f;
    set(r1, f1);
    set(r2, f2);
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
