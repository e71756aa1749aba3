#include "server/sim/rigid/rigid_world.h"

#include <gtest/gtest.h>

namespace crumple::sim {
namespace {

constexpr double kDt = 1.0 / 240;

RigidModel box(const Vec3& half_extents, double mass, RigidKind kind = RigidKind::dynamic) {
  RigidModel model{.kind = kind, .mass = mass};
  model.shapes.push_back({Pose{}, Box{half_extents}});
  return model;
}

Pose at(const Vec3& p) { return {Quat::Identity(), p}; }

TEST(Joint, CarriesWeightAndMomentAsAClampedBeamDoes) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, box({0.1, 0.1, 0.1}, 0, RigidKind::fixed), at({-0.1, 0, 0})));
  ASSERT_TRUE(world.add_body(1, box({0.5, 0.05, 0.05}, 20), at({0.5, 0, 0})));
  const int joint = world.join(1, 0, Vec3::Zero());
  for (int k = 0; k < 480; ++k) world.step(kDt);
  // m g upwards at the wall, and m g l / 2 about z
  EXPECT_LT((world.joint_load(joint).impulse / kDt - Vec3(0, 20 * 9.81, 0)).norm(), 1e-3);
  EXPECT_LT((world.joint_load(joint).couple / kDt - Vec3(0, 0, 20 * 9.81 * 0.5)).norm(), 1e-3);
  EXPECT_LT((world.pose(1).p_WB - Vec3(0.5, 0, 0)).norm(), 1e-4);
}

TEST(Joint, KeepsTwoInFreeFlightOneBodyAndTheirMomenta) {
  RigidWorld world({.gravity = Vec3::Zero()});
  ASSERT_TRUE(world.add_body(0, box({0.5, 0.1, 0.1}, 4), at({-0.5, 0, 0}), {1, 2, 3}));
  ASSERT_TRUE(world.add_body(1, box({0.5, 0.1, 0.1}, 4), at({0.5, 0, 0}), {1, 2, 3}));
  const int joint = world.join(0, 1, Vec3::Zero());
  // As one of 8 kg and 2 m about its middle: an impulse across at an end turns it with J l / 2 over I = m (l^2 + b^2) / 12.
  world.apply_impulse(1, {0, 0, -8}, {1, 0, 0});
  const Vec3 p = world.momentum(0) + world.momentum(1);
  for (int k = 0; k < 240; ++k) world.step(kDt);
  EXPECT_NEAR(world.angular_velocity(0).y(), 8 / (8 * (4 + 0.04) / 12), 0.01);
  EXPECT_LT((world.angular_velocity(0) - world.angular_velocity(1)).norm(), 1e-3);
  EXPECT_LT((world.momentum(0) + world.momentum(1) - p).norm(), 1e-9);
  const Vec3 gap = world.pose(0) * Vec3(0.5, 0, 0) - world.pose(1) * Vec3(-0.5, 0, 0);
  EXPECT_LT(gap.norm(), 2e-3);

  // Parted, each goes its way, and a joint has no bits of it left.
  world.part(joint);
  EXPECT_FALSE(world.is_joined(joint));
  const Vec3 v = world.velocity(0);
  for (int k = 0; k < 10; ++k) world.step(kDt);
  EXPECT_LT((world.velocity(0) - v).norm(), 1e-12);
}

TEST(Joint, OverlappingPartsDoNotCollideUntilTheyArePartedAndThenDo) {
  RigidWorld world({.gravity = Vec3::Zero()});
  ASSERT_TRUE(world.add_body(0, box({0.5, 0.5, 0.5}, 10), at({-0.45, 0, 0})));
  ASSERT_TRUE(world.add_body(1, box({0.5, 0.5, 0.5}, 10), at({0.45, 0, 0})));
  const int joint = world.join(0, 1, Vec3::Zero());
  for (int k = 0; k < 60; ++k) world.step(kDt);
  EXPECT_LT((world.pose(1).p_WB - Vec3(0.45, 0, 0)).norm(), 1e-9);
  world.part(joint);
  for (int k = 0; k < 240; ++k) world.step(kDt);
  EXPECT_GT(world.pose(1).p_WB.x() - world.pose(0).p_WB.x(), 0.99);  // overlap is taken back
}

TEST(Joint, ASleeperThatIsStruckTakesWhatHangsOnItAlong) {
  RigidWorld world({.gravity = Vec3::Zero()});
  ASSERT_TRUE(world.add_body(0, box({0.5, 0.1, 0.1}, 4), at({-0.5, 0, 0})));
  ASSERT_TRUE(world.add_body(1, box({0.5, 0.1, 0.1}, 4), at({0.5, 0, 0})));
  ASSERT_TRUE(world.add_body(2, box({0.1, 0.1, 0.1}, 4), at({-1.3, 0, 0}), {10, 0, 0}));
  const int joint = world.join(0, 1, Vec3::Zero());
  world.sleep(0, false);
  world.sleep(1, false);
  double strongest = 0;
  for (int k = 0; k < 24; ++k) {
    world.step(kDt);
    strongest = std::max(strongest, world.joint_load(joint).impulse.norm());
  }
  EXPECT_FALSE(world.is_asleep(1));
  EXPECT_NEAR((world.momentum(0) + world.momentum(1) + world.momentum(2)).x(), 40, 1e-9);
  EXPECT_NEAR(world.velocity(1).x(), 40.0 / 12, 0.2);
  EXPECT_LT(strongest, 15);  // the second box's share of 40 N s, not all of it
}

// A crane: mast of two, head, jib and counterweight. What its joints bear follows from statics, from the second step on; in
// the first, sweeps end before the small difference of two large moments is right.
TEST(Joint, ACraneBearsItsWeight) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, box({50, 1, 50}, 0, RigidKind::fixed), at({0, -1, 0})));
  ASSERT_TRUE(world.add_body(1, box({0.9, 4.5, 0.9}, 8e3), at({0, 4.5, 0})));
  ASSERT_TRUE(world.add_body(2, box({0.9, 4.5, 0.9}, 8e3), at({0, 13.5, 0})));
  ASSERT_TRUE(world.add_body(3, box({0.9, 3, 0.9}, 5e3), at({0, 21, 0})));
  ASSERT_TRUE(world.add_body(4, box({8, 0.8, 0.8}, 4e3), at({8.9, 20, 0})));
  ASSERT_TRUE(world.add_body(5, box({3.5, 0.8, 0.8}, 7e3), at({-4.4, 20, 0})));
  const int base = world.join(1, 0, {0, 0, 0});
  world.join(2, 1, {0, 9, 0});
  world.join(3, 2, {0, 18, 0});
  const int jib = world.join(4, 3, {0.9, 20, 0});
  world.join(5, 3, {-0.9, 20, 0});
  const double h = 1.0 / 480, g = 9.81;
  for (int k = 0; k < 960; ++k) {
    world.step(h);
    if (k == 0) continue;
    ASSERT_NEAR(world.joint_load(base).impulse.y() / h, 32e3 * g, 0.1 * 32e3 * g) << k;
    ASSERT_NEAR(world.joint_load(jib).couple.z() / h, 4e3 * g * 8, 0.1 * 4e3 * g * 8) << k;
    ASSERT_NEAR(world.joint_load(base).couple.z() / h, g * (4e3 * 8.9 - 7e3 * 4.4), 0.1 * 4e3 * g * 8) << k;
  }
  EXPECT_NEAR(world.joint_load(base).impulse.y() / h, 32e3 * g, 1);
  EXPECT_LT((world.pose(4).p_WB - Vec3(8.9, 20, 0)).norm(), 0.01);
}

}  // namespace
}  // namespace crumple::sim
