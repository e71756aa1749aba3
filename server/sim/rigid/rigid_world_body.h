#pragma once

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "server/sim/rigid/free_rotation.h"
#include "server/sim/rigid/rigid_world_contacts.h"
#include "server/sim/rigid/rigid_world_dynamics.h"
#include "server/sim/rigid/rigid_world_shapes.h"

// Private to rigid_world: one body, its state, and its collision objects in Bullet.
namespace crumple::sim::bullet {

inline Pose product(const Pose& X_AB, const Pose& X_BC) {
  return {(X_AB.R_WB * X_BC.R_WB).normalized(), X_AB * X_BC.p_WB};
}
inline Pose inverse(const Pose& X_AB) {
  const Quat R = X_AB.R_WB.conjugate();
  return {R, -(R * X_AB.p_WB)};
}

struct PrincipalFrame {
  Pose X_BP;
  Vec3 moments;  // [kg m^2]
};
PrincipalFrame principal_frame(const MassProperties& properties);

class Body {
 public:
  // Fixed or kinematic: one collision object a shape.
  Body(DynamicsWorld& world, BodyId id, RigidKind kind, const std::vector<PlacedShape>& shapes, const Pose& X_WB);
  // Moving: one object about the centre of mass. X_BP is the principal frame.
  Body(DynamicsWorld& world, BodyId id, const MassProperties& properties, const Pose& X_WB);
  ~Body();
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  void set_moving_shape(std::unique_ptr<CollisionShape> shape);
  // Keeps X_WB, p and L. Follow by set_moving_shape.
  void set_mass_properties(const MassProperties& properties);
  void set_pose(const Pose& X_WB);

  RigidKind kind() const { return kind_; }
  bool is_moving() const { return kind_ == RigidKind::dynamic && !frozen_; }
  bool is_asleep() const { return asleep_; }
  bool is_stepped() const { return is_moving() && !asleep_; }
  const Pose& X_BP() const { return X_BP_; }
  // The first of the collision objects, and its axes.
  btRigidBody& object() const { return *parts_[0].object; }
  const Pose& X_BO() const { return kind_ == RigidKind::dynamic ? X_BP_ : parts_[0].X_BS; }
  Pose pose() const;

  // Moving bodies. False: the state is not finite or out of this world's bounds for a substep of h.
  bool is_sound(double h) const;
  void begin_substep(const Vec3& gravity);
  bool end_substep(const Vec3& gravity, double h);  // false: as is_sound, and nothing was changed
  void freeze();
  // Moving bodies. Asleep they are to Bullet what fixed bodies are.
  void sleep();
  void wake();

  // Kinematic bodies: velocities towards `next`, which move_to reaches at the end of the substep.
  void aim_at(const Pose& next, double h);
  void move_to(const Pose& next);

  ContactBody contact;  // what Bullet's objects point to
  double mass = 0;
  Vec3 I = Vec3::Zero();  // moments about the principal axes
  Vec3 x = Vec3::Zero();  // centre of mass in W; fixed and kinematic: origin
  Quat R_WP = Quat::Identity();
  Vec3 v = Vec3::Zero();            // of x
  Vec3 L = Vec3::Zero();            // moving bodies: about x
  Vec3 kinematic_w = Vec3::Zero();  // kinematic bodies
  Pose target;                      // kinematic bodies: at the end of the step
  bool carried = false;             // asleep: by what this room does not know
  bool weightless = false;          // woke in this step, and is carried until its end

 private:
  struct Part {
    Pose X_BS;  // of the object's axes; moving bodies: X_BP_
    std::unique_ptr<CollisionShape> shape;
    std::unique_ptr<btRigidBody> object;
  };
  void add_object(Part& part);
  void become_immovable();

  DynamicsWorld& world_;
  RigidKind kind_;
  bool frozen_ = false;
  bool asleep_ = false;
  Pose X_BP_;
  std::vector<Part> parts_;
  Vec3 w_begin_ = Vec3::Zero();  // as given to Bullet at the start of the substep
  btTransform X_begin_;
};

}  // namespace crumple::sim::bullet
