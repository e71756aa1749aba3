#include "server/sim/rigid/rigid_world_joint.h"

namespace crumple::sim::bullet {
namespace {

btTransform to_bullet(const Pose& X) { return bullet::to_bullet(X.R_WB, X.p_WB); }

// Rows k of the block at `rows`, `skip` numbers apart: v -> r x v, negated where asked for.
void set_cross(btScalar* rows, int skip, const btVector3& r) {
  r.getSkewSymmetricMatrix(reinterpret_cast<btVector3*>(rows), reinterpret_cast<btVector3*>(rows + skip),
                           reinterpret_cast<btVector3*>(rows + 2 * skip));
}

void set_diagonal(btScalar* rows, int skip, double value) {
  for (int k = 0; k < 3; ++k) rows[k * skip + k] = value;
}

}  // namespace

Joint::Joint(DynamicsWorld& world, int order, Body& a, Body& b, const Pose& X_WJ)
    : btTypedConstraint(FIXED_CONSTRAINT_TYPE, a.object(), b.object()),
      world_(world),
      a_(a),
      b_(b),
      X_AJ_(product(inverse(a.pose()), X_WJ)),
      X_BJ_(product(inverse(b.pose()), X_WJ)) {
  setUserConstraintId(order);
  setJointFeedback(&feedback_);
  begin_step();
  begin_substep();
  world_.addConstraint(this, true);
}

Joint::~Joint() { world_.removeConstraint(this); }

void Joint::begin_step() {
  impulse.setZero();
  couple.setZero();
}

void Joint::begin_substep() {
  in_a_ = to_bullet(product(inverse(a_.X_BO()), X_AJ_));
  in_b_ = to_bullet(product(inverse(b_.X_BO()), X_BJ_));
  feedback_.m_appliedForceBodyA.setZero();
  feedback_.m_appliedTorqueBodyA.setZero();
}

void Joint::end_substep(double h) {
  const Vec3 push = h * from_bullet(feedback_.m_appliedForceBodyA);
  const Vec3 arm = from_bullet(a_.object().getCenterOfMassTransform().getBasis() * in_a_.getOrigin());
  impulse += push;
  couple += h * from_bullet(feedback_.m_appliedTorqueBodyA) - arm.cross(push);
}

void Joint::getInfo1(btConstraintInfo1* info) {
  info->m_numConstraintRows = 6;
  info->nub = 0;
}

// v_a + w_a x r_a = v_b + w_b x r_b and w_a = w_b, and what the joint's axes are apart.
void Joint::getInfo2(btConstraintInfo2* info) {
  const btTransform X_WA = a_.object().getCenterOfMassTransform() * in_a_, X_WB = b_.object().getCenterOfMassTransform() * in_b_;
  const btVector3 r_a = X_WA.getOrigin() - a_.object().getCenterOfMassPosition();
  const btVector3 r_b = X_WB.getOrigin() - b_.object().getCenterOfMassPosition();
  const int skip = info->rowskip;
  set_diagonal(info->m_J1linearAxis, skip, 1);
  set_diagonal(info->m_J2linearAxis, skip, -1);
  set_cross(info->m_J1angularAxis, skip, -r_a);
  set_cross(info->m_J2angularAxis, skip, r_b);
  set_diagonal(info->m_J1angularAxis + 3 * skip, skip, 1);
  set_diagonal(info->m_J2angularAxis + 3 * skip, skip, -1);

  const btVector3 apart = X_WB.getOrigin() - X_WA.getOrigin();
  btQuaternion turn = X_WB.getRotation() * X_WA.getRotation().inverse();
  if (turn.w() < 0) turn = -turn;
  const btVector3 turned = 2 * btVector3(turn.x(), turn.y(), turn.z());  // small angles; less than the angle for large ones
  for (int k = 0; k < 3; ++k) {
    info->m_constraintError[k * skip] = info->fps * info->erp * apart[k];
    info->m_constraintError[(3 + k) * skip] = info->fps * info->erp * turned[k];
  }
}

}  // namespace crumple::sim::bullet
