#include "server/sim/rigid/rigid_world_body.h"

namespace crumple::sim::bullet {
namespace {

constexpr double kMaxDistance = 2e6;  // [m]
constexpr double kMaxTravel = 2.5e5;  // in one substep [m]; Bullet's broad phase gives up at boxes of 1e6 m

Quat rotation_of(const btTransform& X) {
  const btQuaternion q = X.getRotation();
  return Quat(q.w(), q.x(), q.y(), q.z()).normalized();
}

}  // namespace

Body::Body(DynamicsWorld& world, BodyId id, RigidKind kind, const std::vector<PlacedShape>& shapes, const Pose& X_WB)
    : world_(world), kind_(kind) {
  contact.id = id;
  x = X_WB.p_WB;
  R_WP = X_WB.R_WB.normalized();
  target = pose();
  parts_.reserve(shapes.size());
  for (const PlacedShape& placed : shapes) {
    Part& part = parts_.emplace_back(Part{placed.pose, fixed_shape(placed.shape), nullptr});
    add_object(part);
  }
}

Body::Body(DynamicsWorld& world, BodyId id, const MassProperties& properties, const Pose& X_WB)
    : world_(world), kind_(RigidKind::dynamic) {
  contact.id = id;
  x = X_WB.p_WB;
  R_WP = X_WB.R_WB.normalized();
  set_mass_properties(properties);
}

Body::~Body() {
  for (Part& part : parts_) {
    world_.forget_contacts(*part.object);
    world_.removeRigidBody(part.object.get());
  }
}

void Body::add_object(Part& part) {
  btRigidBody::btRigidBodyConstructionInfo info(is_moving() ? mass : 0, nullptr, part.shape->root(), to_bullet(I));
  const Pose X_WS = is_moving() ? Pose{R_WP, x} : product(pose(), part.X_BS);
  info.m_startWorldTransform = to_bullet(X_WS.R_WB, X_WS.p_WB);
  part.object = std::make_unique<btRigidBody>(info);
  btRigidBody& object = *part.object;
  object.setFlags(0);  // without Bullet's gyroscopic term
  object.setUserPointer(&contact);
  if (kind_ == RigidKind::kinematic) object.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  object.setActivationState(DISABLE_DEACTIVATION);
  world_.addRigidBody(&object);
}

void Body::set_moving_shape(std::unique_ptr<CollisionShape> shape) {
  const double radius = shape->inner_radius();
  if (parts_.empty()) {
    parts_.push_back({X_BP_, std::move(shape), nullptr});
    add_object(parts_[0]);
  } else {
    Part& part = parts_[0];
    world_.forget_contacts(*part.object);
    part.object->setCollisionShape(shape->root());
    part.shape = std::move(shape);
    part.object->setMassProps(mass, to_bullet(I));
  }
  parts_[0].object->setCcdMotionThreshold(radius);
  parts_[0].object->setCcdSweptSphereRadius(radius / 2);
}

PrincipalFrame principal_frame(const MassProperties& properties) {
  const PrincipalAxes axes = principal_axes(properties.inertia);
  return {{Quat(axes.R_BP).normalized(), properties.com}, axes.moments};
}

void Body::set_mass_properties(const MassProperties& properties) {
  const Pose X_WB = pose();
  const PrincipalFrame frame = principal_frame(properties);
  const Vec3 p = mass * v;
  mass = properties.mass;
  I = frame.moments;
  X_BP_ = frame.X_BP;
  v = p / mass;
  set_pose(X_WB);
}

void Body::set_pose(const Pose& X_WB) {
  const Pose X_WP = product(X_WB, X_BP_);
  x = X_WP.p_WB;
  R_WP = X_WP.R_WB;
  for (Part& part : parts_) world_.forget_contacts(*part.object);
}

Pose Body::pose() const { return product({R_WP, x}, inverse(X_BP_)); }

bool Body::is_sound(double h) const {
  return x.allFinite() && v.allFinite() && L.allFinite() && R_WP.coeffs().allFinite() &&
         sim::angular_velocity(R_WP, I, L).allFinite() && x.cwiseAbs().maxCoeff() < kMaxDistance &&
         v.norm() * h < kMaxTravel;
}

void Body::begin_substep(const Vec3& gravity) {
  btRigidBody& object = *parts_[0].object;
  contact.rebounds = false;
  w_begin_ = sim::angular_velocity(R_WP, I, L);
  X_begin_ = to_bullet(R_WP, x);
  object.setLinearVelocity(to_bullet(v));
  object.setAngularVelocity(to_bullet(w_begin_));
  object.setCenterOfMassTransform(X_begin_);
  object.clearForces();
  object.applyCentralForce(to_bullet(mass * gravity));
}

bool Body::end_substep(const Vec3& gravity, double h) {
  const btRigidBody& object = *parts_[0].object;
  const Vec3 v_old = v + h * gravity, v_new = from_bullet(object.getLinearVelocity());
  const Vec3 turn = from_bullet(object.getAngularVelocity()) - w_begin_;
  const Vec3 L_old = L, L_new = L + world_inertia(R_WP, I) * turn;  // no impulse: exactly L
  const btTransform& X = object.getWorldTransform();                // moved where an overlap was repaired
  const Quat R_old = X.getBasis() == X_begin_.getBasis() ? R_WP : rotation_of(X);

  const double t = contact.rebounds ? contact.rebound_time : 0;
  const Vec3 x_new = from_bullet(X.getOrigin()) + t * v_old + (h - t) * v_new;
  if (!x_new.allFinite() || !v_new.allFinite() || !L_new.allFinite() || !R_old.coeffs().allFinite()) return false;
  x = x_new;
  v = v_new;
  L = L_new;
  R_WP = rotate_freely(rotate_freely(R_old, I, L_old, t), I, L_new, h - t);
  return true;
}

void Body::freeze() {
  frozen_ = true;
  become_immovable();
}

void Body::sleep() {
  asleep_ = true;
  become_immovable();
}

void Body::wake() {
  asleep_ = false;
  btRigidBody& object = *parts_[0].object;
  world_.forget_contacts(object);
  world_.removeRigidBody(&object);
  object.setMassProps(mass, to_bullet(I));
  world_.addRigidBody(&object);
}

void Body::become_immovable() {
  v.setZero();
  L.setZero();
  btRigidBody& object = *parts_[0].object;
  world_.forget_contacts(object);
  world_.removeRigidBody(&object);
  object.setMassProps(0, btVector3(0, 0, 0));
  object.setLinearVelocity(btVector3(0, 0, 0));
  object.setAngularVelocity(btVector3(0, 0, 0));
  object.clearForces();
  object.setCenterOfMassTransform(to_bullet(R_WP, x));
  world_.addRigidBody(&object);
}

void Body::aim_at(const Pose& next, double h) {
  const Quat turn = next.R_WB * R_WP.conjugate();
  const Eigen::AngleAxisd angle(turn.w() < 0 ? Quat(-turn.coeffs()) : turn);
  v = (next.p_WB - x) / h;
  kinematic_w = angle.angle() / h * angle.axis();
  for (Part& part : parts_) {
    const Vec3 r = R_WP * part.X_BS.p_WB;
    part.object->setLinearVelocity(to_bullet(Vec3(v + kinematic_w.cross(r))));
    part.object->setAngularVelocity(to_bullet(kinematic_w));
  }
}

void Body::move_to(const Pose& next) {
  x = next.p_WB;
  R_WP = next.R_WB.normalized();
  for (Part& part : parts_) {
    const Pose X_WS = product(next, part.X_BS);
    part.object->setCenterOfMassTransform(to_bullet(X_WS.R_WB, X_WS.p_WB));
    part.object->setInterpolationWorldTransform(part.object->getWorldTransform());
  }
}

}  // namespace crumple::sim::bullet
