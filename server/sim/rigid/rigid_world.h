#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "common/error.h"
#include "common/types.h"
#include "server/sim/rigid/mass_properties.h"
#include "server/sim/scene.h"

namespace crumple::sim {

struct RigidSettings {
  Vec3 gravity{0, -9.81, 0};  // [m/s^2]
  int iterations = 30;      // at most, of the contact solver: sweeps forth and back
  double tolerance = 1e-9;  // less of them once a sweep changes no relative velocity by more than this [m/s]
};

// What a contact did to its two bodies during the last step(), summed over the substeps in which Bullet kept it as
// the same point. Contacts that pushed nothing are left out.
struct ContactImpulse {
  BodyId a = 0, b = 0;
  Vec3 point_a_W, point_b_W;  // the touching points of a and b when the step first felt the contact [m]
  Vec3 point_a_B, point_b_B;  // the same material points in the axes of a and of b [m]
  Vec3 normal_W;              // from b to a
  Vec3 impulse_W;             // on a; on b it is the opposite [N s]
  double normal_impulse = 0;  // its part along the normal, >= 0 [N s]
};

struct RigidStepReport {
  std::vector<BodyId> frozen;    // bodies whose state became non-finite (or left the world) in this step
  std::vector<BodyId> woken;     // bodies that were asleep and were touched
  int contacts = 0;              // contact points in the last substep
  double worst_penetration = 0;  // deepest overlap at the start of any substep [m]
  int sweeps = 0;                // of the contact solver, forth and back, summed over islands and substeps
  double residual = 0;           // what the last sweep of any island still changed [m/s]
};

// What a joint did in the last step, on its first body.
struct JointLoad {
  Vec3 impulse = Vec3::Zero();  // at the joint's point, in W [N s]
  Vec3 couple = Vec3::Zero();   // what is left of the moment about that point, in W [N m s]
};

// Collision shape of a body that changes its shape: convex parts, or one triangle mesh, in body axes.
using DeformableShape = std::variant<std::vector<ConvexHull>, SurfaceMesh>;

namespace bullet {
class CollisionShape;
}

// The next shape and mass properties of a deformable body, made ready apart from any world: several threads may each
// make one at the same time.
class PreparedShape {
 public:
  // Errors: no part, non-finite points, no sound triangle, mass or inertia not positive and finite.
  static Result<PreparedShape> make(const DeformableShape& shape, const MassProperties& properties);
  PreparedShape(PreparedShape&&) noexcept;
  PreparedShape& operator=(PreparedShape&&) noexcept;
  ~PreparedShape();

 private:
  friend class RigidWorld;
  PreparedShape(std::unique_ptr<bullet::CollisionShape> shape, const MassProperties& properties);
  std::unique_ptr<bullet::CollisionShape> shape_;
  MassProperties properties_;
};

// Rigid bodies and their contacts with each other, over Bullet 3.24 in double precision (source unmodified; this class
// is the only one that knows it). Same calls in the same order, same bits. Nothing falls asleep by itself.
//
// Axes: callers speak of the body's own axes B. Inside, a moving body is kept by its centre of mass, its orientation
// along principal axes, its velocity v of the centre of mass and its angular momentum L about it; the angular velocity
// is always I^-1 L. Between contacts L is constant exactly (free_rotation.h), contacts change it by their impulses;
// Bullet's gyroscopic term and damping are off.
//
// Contact law, a substep of length h, approach velocity v of a contact point, gap d:
//   v+ >= -max(d, 0)/h                   so that a gap closes without overlap;
//   v+ = -e v                            where the gap closes within the substep faster than max(2 |g| h, 0.01 m/s):
//     the rebound happens at the time t = d / |v| in the substep: up to there the bodies move with their old velocity,
//     from there with the new one, so that drop heights keep their value whatever dt is (FORMULAS F6);
//   friction in a round cone |f| <= mu N; overlap is taken back by moving the bodies by a fifth of it, which does not
//   enter their velocity or the reported impulses.
// A pair's restitution is the product of its two bodies' (Bullet's rule), its friction their geometric mean.
// Bodies that fly more than half their smallest extent in a substep are swept as a ball (Bullet's predictive contacts).
class RigidWorld {
 public:
  explicit RigidWorld(const RigidSettings& settings = {});
  ~RigidWorld();
  RigidWorld(const RigidWorld&) = delete;
  RigidWorld& operator=(const RigidWorld&) = delete;

  // A body as in a scene; `id` must be new. velocity: of the body's origin, in W. Errors: those of shapes_mass for a
  // moving body, a plane on a body that is not fixed, a triangle mesh without a sound triangle.
  Result<void> add_body(BodyId id, const RigidModel& model, const Pose& X_WB, const Vec3& velocity = Vec3::Zero(),
                        const Vec3& angular_velocity = Vec3::Zero());
  // A moving body whose shape and mass properties (in body axes) will change. Errors: as set_shape_and_mass.
  Result<void> add_deformable(BodyId id, const DeformableShape& shape, const MassProperties& properties,
                              double friction, double restitution, const Pose& X_WB,
                              const Vec3& velocity = Vec3::Zero(), const Vec3& angular_velocity = Vec3::Zero());
  void remove(BodyId id);

  // New shape and mass properties of a moving body. Body axes keep their place, so that no point moves that the caller
  // did not move in B; momentum p and angular momentum L (each about the respective centre of mass) keep their values:
  // the velocity of the centre of mass becomes p / m, the angular velocity I^-1 L (Jones et al. 2016, section 3.3).
  void set_shape_and_mass(BodyId id, PreparedShape next);
  // Errors, nothing changed: those of PreparedShape::make.
  Result<void> set_shape_and_mass(BodyId id, const DeformableShape& shape, const MassProperties& properties);

  // Kinematic bodies: where the body is to be at the end of the next step; it moves there evenly and drags what it
  // touches. Without a target it stays.
  void set_target(BodyId id, const Pose& X_WB);
  void set_friction(BodyId id, double friction);
  void set_restitution(BodyId id, double restitution);
  // Moving bodies; no effect on others and on frozen ones.
  void set_pose(BodyId id, const Pose& X_WB);  // velocities in W stay
  void set_velocity(BodyId id, const Vec3& com_velocity, const Vec3& angular_velocity);
  void apply_impulse(BodyId id, const Vec3& impulse_W, const Vec3& point_W);
  void apply_momentum(BodyId id, const Vec3& linear, const Vec3& angular);  // added to p and to L about the centre

  // Takes a moving body out of the step, as if it were fixed, its velocities zero; no effect on others. It wakes by itself
  // when a body that is stepped is about to touch it (kinematic ones do not), and may be woken. No impulse, pose or shape
  // may be given to it meanwhile. carried: what holds it up is not in this room; if it is touched, the step in which it
  // wakes spares it its weight, for which nobody could ask the others any more.
  void sleep(BodyId id, bool carried);
  void wake(BodyId id);
  bool is_asleep(BodyId id) const;

  // Joins two bodies rigidly at a point as they stand, at least one of them moving; they do not collide with each other
  // from then on. A joint keeps them together through 30 sweeps of the contact solver: long chains of it sag. A body that
  // wakes because it is touched wakes those that it is joined to. Ids count from 0 and are not used again.
  int join(BodyId a, BodyId b, const Vec3& point_W);
  void part(int joint);  // for good; no effect on one that is parted
  bool is_joined(int joint) const;
  JointLoad joint_load(int joint) const;  // of one that is joined
  Vec3 joint_point(int joint) const;      // in W, of one that is joined

  // dt > 0 [s] in `substeps` >= 1 equal parts; one part in which contact is found and solved once each.
  // A body whose state is not finite, is beyond 2e6 m or faster than 2.5e5 m per substep is frozen: it stays for good,
  // as a fixed body, where it last was.
  RigidStepReport step(double dt, int substeps = 1);
  const std::vector<ContactImpulse>& contact_impulses() const;

  bool contains(BodyId id) const;
  bool is_moving(BodyId id) const;         // dynamic and not frozen; asleep or not
  Pose pose(BodyId id) const;              // X_WB
  Vec3 com(BodyId id) const;               // centre of mass in W; fixed and kinematic bodies: their origin
  Vec3 velocity(BodyId id) const;          // of com() [m/s]
  Vec3 angular_velocity(BodyId id) const;  // [rad/s]
  // 0 for bodies that are not moving freely:
  double mass(BodyId id) const;
  Mat3 inertia(BodyId id) const;  // about com(), in W [kg m^2]
  Vec3 momentum(BodyId id) const;
  Vec3 angular_momentum(BodyId id) const;  // about com()
  double kinetic_energy(BodyId id) const;  // [J]

  // Every number that the next step depends on and that is not constant: states and warm starts of contacts.
  void append_state(std::vector<double>& state) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple::sim
