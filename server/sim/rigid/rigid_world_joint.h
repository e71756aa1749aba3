#pragma once

#include <new>

#include "server/sim/rigid/rigid_world_body.h"

// Private to rigid_world.
namespace crumple::sim::bullet {

// Six rows that keep the axes J of a joint, as two bodies carry them, in one place: three of the point, three of the
// rotation. A fifth of what they are apart is taken back in each substep, as with overlaps.
class Joint : public btTypedConstraint {
 public:
  // X_WJ: where the joint is now. The bodies must outlive it, and do not collide with each other as long as it is there.
  Joint(DynamicsWorld& world, int order, Body& a, Body& b, const Pose& X_WJ);
  ~Joint() override;
  // Bullet's own allocator knows 16 bytes, and poses want more.
  static void* operator new(std::size_t size) { return ::operator new(size, std::align_val_t{alignof(Joint)}); }
  static void operator delete(void* memory) { ::operator delete(memory, std::align_val_t{alignof(Joint)}); }
  Joint(const Joint&) = delete;
  Joint& operator=(const Joint&) = delete;

  void begin_step();
  void begin_substep();       // the bodies' axes in Bullet may have changed
  void end_substep(double h); // adds what it did to the loads
  Vec3 point_W() const { return a_.pose() * X_AJ_.p_WB; }

  Body& a() const { return a_; }
  Body& b() const { return b_; }
  Vec3 impulse = Vec3::Zero();  // on a at the point, in this step [N s]
  Vec3 couple = Vec3::Zero();   // on a, what is left of the moment about the point [N m s]

 private:
  void getInfo1(btConstraintInfo1* info) override;
  void getInfo2(btConstraintInfo2* info) override;
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0; }

  DynamicsWorld& world_;
  Body &a_, &b_;
  Pose X_AJ_, X_BJ_;               // in the bodies' axes
  btTransform in_a_, in_b_;        // in their objects' axes
  btJointFeedback feedback_;
};

}  // namespace crumple::sim::bullet
