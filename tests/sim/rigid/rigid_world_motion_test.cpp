#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/sim/rigid/primitive_meshes.h"
#include "server/sim/rigid/rigid_world.h"

// Bodies that touch nothing, and bodies that change.
namespace crumple::sim {
namespace {

RigidModel solid(const Shape& shape, double mass) {
  RigidModel model;
  model.shapes = {{Pose{}, shape}};
  model.mass = mass;
  return model;
}

TEST(RigidWorld, FreeFallIsSymplecticEuler) {  // F1: v = -g n dt, z = -g dt^2 n (n+1) / 2
  for (const int rate : {30, 60, 240}) {
    RigidWorld world({.gravity = {0, 0, -9.81}});
    ASSERT_TRUE(world.add_body(0, solid(Sphere{0.5}, 3), {}));
    for (int i = 0; i < rate; ++i) world.step(1.0 / rate);
    EXPECT_NEAR(world.velocity(0).z(), -9.81, 1e-11);
    EXPECT_NEAR(world.pose(0).p_WB.z(), -9.81 / 2 * (rate + 1) / rate, 1e-11);
  }
}

TEST(RigidWorld, ThrownBodysCentreOfMassFliesAParabola) {
  RigidModel model;  // a hammer: its origin is not its centre of mass
  model.shapes = {{Pose{}, Box{{0.05, 0.5, 0.05}}}, {Pose{Quat::Identity(), {0, 0.5, 0}}, Box{{0.2, 0.1, 0.1}}}};
  RigidWorld world;
  const Vec3 origin_velocity(3, 8, -1), w(2, 5, -7);
  ASSERT_TRUE(world.add_body(0, model, {}, origin_velocity, w));
  const Vec3 c0 = world.com(0), v0 = origin_velocity + w.cross(c0), L = world.angular_momentum(0);
  const int n = 240;
  for (int i = 0; i < n; ++i) world.step(1.0 / n);
  const Vec3 expected = c0 + v0 + Vec3(0, -9.81 / 2 * (n + 1) / n, 0);
  EXPECT_LT((world.com(0) - expected).norm(), 1e-11);
  EXPECT_EQ(world.angular_momentum(0), L);
}

// F11 through Bullet's pipeline: moments 1 : 2 : 3 is a flat plate of two masses; here point masses by hand.
TEST(RigidWorld, MiddleAxisSpinFlips) {
  MassProperties properties{.mass = 1, .com = Vec3::Zero(), .inertia = Vec3(1, 2, 3).asDiagonal()};
  const DeformableShape shape = std::vector<ConvexHull>{{box_surface({1, 1, 1}).vertices}};
  for (const int rate : {60, 250}) {
    RigidWorld world({.gravity = Vec3::Zero()});
    ASSERT_TRUE(world.add_deformable(0, shape, properties, 0.5, 0, {}, Vec3::Zero(), {1e-3, 1, 1e-3}));
    const Vec3 L = world.angular_momentum(0);
    const double E = world.kinetic_energy(0);
    double lowest = 1;
    for (int i = 0; i < 60 * rate; ++i) {
      world.step(1.0 / rate);
      ASSERT_NEAR(world.kinetic_energy(0) / E, 1, 1e-3);
      lowest = std::min(lowest, (world.pose(0).R_WB.conjugate() * world.angular_velocity(0)).y());
    }
    EXPECT_LT(lowest, -0.99);
    EXPECT_EQ(world.angular_momentum(0), L);
  }
}

TEST(RigidWorld, UniformShrinkSpinsUp) {  // F11: 0.8 in size, I x .64, w x 1.5625, energy x 1.5625
  const SurfaceMesh box = box_surface({1, 2, 3});
  const MassProperties properties = with_mass(box_mass({1, 2, 3}, 1), 10);
  RigidWorld world({.gravity = Vec3::Zero()});
  const Pose X_WB{Quat(Eigen::AngleAxisd(0.4, Vec3::UnitX())), {1, 2, 3}};
  ASSERT_TRUE(
      world.add_deformable(0, std::vector<ConvexHull>{{box.vertices}}, properties, 0.5, 0, X_WB, {1, 0, 0}, {3, 2, 1}));
  const Vec3 w = world.angular_velocity(0), L = world.angular_momentum(0), p = world.momentum(0);
  const double spin = world.kinetic_energy(0) - 5;
  std::vector<Vec3> smaller = box.vertices;
  for (Vec3& v : smaller) v *= 0.8;
  ASSERT_TRUE(
      world.set_shape_and_mass(0, std::vector<ConvexHull>{{smaller}}, with_mass(box_mass({0.8, 1.6, 2.4}, 1), 10)));
  EXPECT_LT((world.angular_velocity(0) - 1.5625 * w).norm(), 1e-12);
  EXPECT_NEAR(world.kinetic_energy(0) - 5, 1.5625 * spin, 1e-11);
  EXPECT_EQ(world.angular_momentum(0), L);
  EXPECT_LT((world.momentum(0) - p).norm(), 1e-12);
}

// A dent a step: the centre of mass and the principal axes wander, the body's axes must not (STABILITY row 38).
TEST(RigidWorld, DentingEveryStepMovesNoWorldPointAndKeepsMomenta) {
  SurfaceMesh box = box_surface({0.5, 0.4, 0.3});
  RigidWorld world({.gravity = Vec3::Zero()});
  ASSERT_TRUE(world.add_deformable(0, box, with_mass(closed_mesh_mass(box, 1), 20), 0.5, 0, {}, {1, 2, 3}, {4, 5, 6}));
  const Vec3 L = world.angular_momentum(0), p = world.momentum(0);
  for (int i = 0; i < 200; ++i) {
    box.vertices[i % 8] *= 0.97;
    const Pose before = world.pose(0);
    ASSERT_TRUE(world.set_shape_and_mass(0, box, with_mass(closed_mesh_mass(box, 1), 20)));
    for (const Vec3& v : box.vertices) ASSERT_LT((world.pose(0) * v - before * v).norm(), 1e-12);
    world.step(1.0 / 120);
  }
  EXPECT_LT((world.angular_momentum(0) - L).norm(), 1e-12 * L.norm());
  EXPECT_LT((world.momentum(0) - p).norm(), 1e-12 * p.norm());
}

TEST(RigidWorld, FlattenedToAPlateItStaysFinite) {
  SurfaceMesh box = box_surface({0.5, 0.5, 0.5});
  RigidWorld world;
  ASSERT_TRUE(world.add_deformable(0, std::vector<ConvexHull>{{box.vertices}}, box_mass({0.5, 0.5, 0.5}, 100), 0.5, 0,
                                   {}, Vec3::Zero(), {1, 9, 2}));
  const Vec3 L = world.angular_momentum(0);
  for (Vec3& v : box.vertices) v.x() = 0;
  const std::vector<double> masses(8, 12.5);
  ASSERT_TRUE(world.set_shape_and_mass(0, std::vector<ConvexHull>{{box.vertices}}, point_mass(box.vertices, masses)));
  for (int i = 0; i < 120; ++i) EXPECT_TRUE(world.step(1.0 / 120).frozen.empty());
  EXPECT_EQ(world.angular_momentum(0), L);
}

TEST(RigidWorld, BadShapesChangeNothing) {
  const std::vector<Vec3> box = box_surface({0.5, 0.5, 0.5}).vertices;
  RigidWorld world;
  const MassProperties properties = box_mass({0.5, 0.5, 0.5}, 1);
  ASSERT_TRUE(world.add_deformable(0, std::vector<ConvexHull>{{box}}, properties, 0.5, 0, {}));
  std::vector<double> before, after;
  world.append_state(before);
  std::vector<Vec3> bad = box;
  bad[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(world.set_shape_and_mass(0, std::vector<ConvexHull>{{bad}}, properties));
  EXPECT_FALSE(world.set_shape_and_mass(0, std::vector<ConvexHull>{}, properties));
  EXPECT_FALSE(world.set_shape_and_mass(0, SurfaceMesh{box, {{0, 0, 1}}}, properties));
  EXPECT_FALSE(world.set_shape_and_mass(0, std::vector<ConvexHull>{{box}}, MassProperties{}));
  world.append_state(after);
  EXPECT_EQ(before, after);
}

TEST(RigidWorld, ImpulseAtAPointMovesAndTurns) {
  RigidWorld world({.gravity = Vec3::Zero()});
  ASSERT_TRUE(world.add_body(0, solid(Box{{0.5, 0.5, 0.5}}, 6), {}));  // I = 1 kg m^2
  world.apply_impulse(0, {0, 12, 0}, {0.5, 0, 0});
  EXPECT_LT((world.velocity(0) - Vec3(0, 2, 0)).norm(), 1e-14);
  EXPECT_LT((world.angular_velocity(0) - Vec3(0, 0, 6)).norm(), 1e-13);
}

TEST(RigidWorld, NonFiniteBodyFreezesAndTheOthersGoOnBitForBit) {
  const auto run = [](bool poison) {
    RigidWorld world;
    RigidModel floor = solid(Plane{}, 0);
    floor.kind = RigidKind::fixed;
    EXPECT_TRUE(world.add_body(0, floor, {}));
    for (BodyId id = 1; id < 6; ++id) {
      EXPECT_TRUE(world.add_body(id, solid(Box{{0.5, 0.5, 0.5}}, 1), {Quat::Identity(), {3.0 * id, 1, 0}}, {0, 0, 1},
                                 {1, 2, 3}));
    }
    std::vector<double> trace;
    for (int i = 0; i < 240; ++i) {
      if (poison && i == 60) world.apply_impulse(3, Vec3::Constant(std::numeric_limits<double>::infinity()), {9, 0, 0});
      const RigidStepReport report = world.step(1.0 / 120);
      EXPECT_EQ(report.frozen, poison && i == 60 ? std::vector<BodyId>{3} : std::vector<BodyId>{});
      for (const BodyId id : {1, 2, 4, 5}) {
        for (const double q :
             {world.com(id).x(), world.com(id).y(), world.velocity(id).z(), world.angular_momentum(id).x()})
          trace.push_back(q);
      }
    }
    EXPECT_EQ(world.is_moving(3), !poison);
    EXPECT_TRUE(world.com(3).allFinite());
    return trace;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(RigidWorld, WhatFliesOutOfTheWorldFreezes) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, solid(Sphere{0.5}, 1), {}));
  world.set_velocity(0, {1e9, 0, 0}, Vec3::Zero());
  EXPECT_EQ(world.step(1.0 / 60).frozen, std::vector<BodyId>{0});
  EXPECT_EQ(world.pose(0).p_WB, Vec3::Zero().eval());
}

}  // namespace
}  // namespace crumple::sim
