#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/sim/rigid/primitive_meshes.h"
#include "server/sim/rigid/rigid_world.h"

namespace crumple::sim {
namespace {

RigidModel body(const Shape& shape, double mass, double friction = 0.5, double restitution = 0) {
  RigidModel model;
  model.shapes = {{Pose{}, shape}};
  model.mass = mass;
  model.friction = friction;
  model.restitution = restitution;
  return model;
}

RigidModel fixed(const Shape& shape, double friction = 0.5, double restitution = 1) {
  RigidModel model = body(shape, 0, friction, restitution);
  model.kind = RigidKind::fixed;
  return model;
}

Pose at(double x, double y, double z) { return {Quat::Identity(), {x, y, z}}; }

// FORMULAS F6: bounce heights h0 e^(2n), rest after sqrt(2 h0/g) (1+e)/(1-e) = 1.3546 s.
class Bounce : public testing::TestWithParam<std::tuple<Shape, double>> {};

TEST_P(Bounce, HeightsFallBySquaredRestitution) {
  const auto& [shape, dt] = GetParam();
  const double lowest = 0.5, e = 0.5;
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  ASSERT_TRUE(world.add_body(1, body(shape, 2, 0.5, e), at(0, 1 + lowest, 0)));
  std::vector<double> peaks;
  double last_motion = 0, previous = -1;
  for (int i = 0; i < 4 / dt; ++i) {
    world.step(dt);
    const double v = world.velocity(1).y();
    if (previous > 0 && v <= 0) peaks.push_back(world.com(1).y() - lowest);
    previous = v;
    if (std::abs(v) > 1e-3) last_motion = i * dt;
  }
  ASSERT_GE(peaks.size(), 3u);
  for (int n = 1; n <= 3; ++n) EXPECT_NEAR(peaks[n - 1], std::pow(e, 2 * n), 0.02 * std::pow(e, 2 * n)) << n;
  EXPECT_NEAR(last_motion, 1.3546, 0.05);
  EXPECT_NEAR(world.com(1).y(), lowest, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(, Bounce,
                         testing::Values(std::tuple(Shape(Sphere{0.5}), 1.0 / 240),
                                         std::tuple(Shape(Sphere{0.5}), 1.0 / 250),
                                         std::tuple(Shape(Box{{0.5, 0.5, 0.5}}), 1.0 / 240),
                                         std::tuple(Shape(Cylinder{0.5, 0.5}), 1.0 / 240)));

TEST(RigidWorld, ElasticBallBouncesForeverToTheSameHeight) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  ASSERT_TRUE(world.add_body(1, body(Sphere{0.5}, 2, 0.5, 1), at(0, 1.5, 0)));
  double peak = 0;
  for (int i = 0; i < 20 * 240; ++i) {
    world.step(1.0 / 240);
    if (i > 19 * 240) peak = std::max(peak, world.com(1).y());
  }
  EXPECT_NEAR(peak, 1.5, 0.01);
}

// FORMULAS F8: interface k from the top carries k m g.
TEST(RigidWorld, StackCarriesItsWeight) {
  const int n = 10;
  const double dt = 1.0 / 120, g = 9.81;
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  for (int i = 0; i < n; ++i) ASSERT_TRUE(world.add_body(i + 1, body(Box{{0.5, 0.5, 0.5}}, 1), at(0, 0.5 + i, 0)));
  for (int i = 0; i < 10 * 120; ++i) world.step(dt);
  std::vector<double> carried(n, 0);
  for (const ContactImpulse& c : world.contact_impulses()) {
    ASSERT_LT(std::min(c.a, c.b), std::max(c.a, c.b));
    carried[std::min(c.a, c.b)] += c.normal_impulse;
  }
  for (int lower = 0; lower < n; ++lower) EXPECT_NEAR(carried[lower], (n - lower) * g * dt, 0.005 * g * dt) << lower;
  for (int i = 1; i <= n; ++i) {
    EXPECT_LT((world.com(i) - Vec3(0, i - 0.5, 0)).norm(), 0.01);
    EXPECT_LT(world.velocity(i).norm(), 1e-3);
  }
}

// FORMULAS F9: v1 = (1 - e r)/(1 + r), v2 = (1 + e)/(1 + r), r = m2/m1.
TEST(RigidWorld, TwoBallsExchangeMomentum) {
  for (const auto& [r, e] : {std::pair(0.01, 1.0), {1.0, 1.0}, {100.0, 1.0}, {1e4, 1.0}, {2.0, 0.5}, {1.0, 0.0}}) {
    RigidWorld world({.gravity = Vec3::Zero()});
    ASSERT_TRUE(world.add_body(0, body(Sphere{0.5}, 1, 0, 1), at(-1, 0, 0), {1, 0, 0}));
    ASSERT_TRUE(world.add_body(1, body(Sphere{0.5}, r, 0, e), at(0.4, 0, 0)));
    Vec3 total = Vec3::Zero();
    for (int i = 0; i < 240; ++i) {
      world.step(1.0 / 240);
      for (const ContactImpulse& c : world.contact_impulses()) total += c.a == 1 ? c.impulse_W : Vec3(-c.impulse_W);
    }
    EXPECT_NEAR(world.velocity(0).x(), (1 - e * r) / (1 + r), 1e-9) << r;
    EXPECT_NEAR(world.velocity(1).x(), (1 + e) / (1 + r), 1e-9) << r;
    EXPECT_NEAR((world.momentum(0) + world.momentum(1)).x(), 1, 1e-12);
    EXPECT_LT((total - world.momentum(1)).norm(), 1e-9);
  }
}

TEST(RigidWorld, CradleWithGapsPassesTheBlowOn) {  // k in, k out
  for (const int k : {1, 2}) {
    RigidWorld world({.gravity = Vec3::Zero()});
    for (int i = 0; i < 5; ++i) {
      const bool coming = i < k;
      ASSERT_TRUE(world.add_body(i, body(Sphere{0.5}, 1, 0, 1), at(1.01 * i - (coming ? 0.5 : 0), 0, 0),
                                 {coming ? 1.0 : 0.0, 0, 0}));
    }
    for (int i = 0; i < 480; ++i) world.step(1.0 / 240);
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(world.velocity(i).x(), i >= 5 - k ? 1 : 0, 1e-9) << k << " " << i;
  }
}

// The impulses that a step reports are the whole change of momentum, and of angular momentum about the centre.
TEST(RigidWorld, ReportedImpulsesAreTheChangeOfMomentum) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  const Pose tilted{Quat(Eigen::AngleAxisd(0.6, Vec3(1, 0.3, 0.5).normalized())), {0, 1, 0}};
  ASSERT_TRUE(world.add_body(1, body(Box{{0.5, 0.3, 0.7}}, 3, 0.4, 0.3), tilted, {2, -3, 1}, {1, 2, 3}));
  ASSERT_TRUE(world.add_body(2, body(Sphere{0.4}, 1, 0.4, 0.3), at(0.1, 2.2, 0), {0, -5, 0}));
  const double dt = 1.0 / 240;
  int felt = 0;
  for (int i = 0; i < 480; ++i) {
    std::array<Vec3, 3> p, L, c;
    for (BodyId id = 1; id < 3; ++id)
      p[id] = world.momentum(id), L[id] = world.angular_momentum(id), c[id] = world.com(id);
    world.step(dt);
    for (const ContactImpulse& contact : world.contact_impulses()) {
      ++felt;
      p[contact.a] += contact.impulse_W;
      p[contact.b] -= contact.impulse_W;
      L[contact.a] += (contact.point_a_W - c[contact.a]).cross(contact.impulse_W);
      L[contact.b] -= (contact.point_b_W - c[contact.b]).cross(contact.impulse_W);
    }
    for (BodyId id = 1; id < 3; ++id) {
      ASSERT_LT((world.momentum(id) - p[id] - dt * world.mass(id) * Vec3(0, -9.81, 0)).norm(), 1e-10) << i;
      ASSERT_LT((world.angular_momentum(id) - L[id]).norm(), 1e-10) << i;
    }
  }
  EXPECT_GT(felt, 100);
}

TEST(RigidWorld, SubstepsAddUpToTheChangeOfMomentum) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  ASSERT_TRUE(world.add_body(1, body(Box{{0.5, 0.5, 0.5}}, 3), at(0, 0.5, 0)));
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60, 4);
  double sum = 0;
  for (const ContactImpulse& contact : world.contact_impulses()) sum += contact.normal_impulse;
  EXPECT_EQ(world.contact_impulses().size(), 4u);
  EXPECT_NEAR(sum, 3 * 9.81 / 60, 1e-6);
}

// FORMULAS F7: holds up to tan = mu (26.565 degrees for 0.5), slides beyond with g (sin - mu cos).
class Incline : public testing::TestWithParam<double> {};  // direction of the slope in the plane's own axes

TEST_P(Incline, SticksBelowTheFrictionAngleAndSlidesAbove) {
  for (const auto& [degrees, mu] : {std::pair(26.0, 0.5), {27.1, 0.5}, {30.0, 0.5}, {30.0, 0.3}}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Quat yaw(Eigen::AngleAxisd(GetParam(), Vec3::UnitY()));
    const Quat R = Quat(Eigen::AngleAxisd(angle, yaw * Vec3::UnitZ()));
    RigidWorld world;
    ASSERT_TRUE(world.add_body(0, fixed(Plane{}, mu), {R, Vec3::Zero()}));
    ASSERT_TRUE(world.add_body(1, body(Box{{0.5, 0.25, 0.5}}, 1, mu), {R, R * Vec3(0, 0.25, 0)}));
    const double duration = degrees < 26.5 ? 10 : 2;
    const double dt = 1.0 / 120;
    const Vec3 start = world.com(1);
    for (int i = 0; i < duration / dt; ++i) world.step(dt);
    if (degrees < 26.5) {
      EXPECT_LT((world.com(1) - start).norm(), 1e-3);
    } else {
      const double a = 9.81 * (std::sin(angle) - mu * std::cos(angle));
      EXPECT_NEAR(world.velocity(1).norm() / duration, a, 0.01 * a) << degrees;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, Incline, testing::Values(0.0, 0.4, std::numbers::pi / 4));

TEST(RigidWorld, KinematicPusherPushesABox) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}, 0.5), {}));
  RigidModel pusher = body(Box{{0.5, 0.5, 0.5}}, 0);
  pusher.kind = RigidKind::kinematic;
  ASSERT_TRUE(world.add_body(1, pusher, at(-2, 0.6, 0)));
  ASSERT_TRUE(world.add_body(2, body(Box{{0.5, 0.5, 0.5}}, 1), at(0, 0.5, 0)));
  for (int i = 1; i <= 240; ++i) {  // 1 m/s for 2 s
    world.set_target(1, at(-2 + i / 120.0, 0.6, 0));
    world.step(1.0 / 120, 2);
    EXPECT_NEAR(world.velocity(1).x(), 1, 1e-9);
  }
  EXPECT_NEAR(world.pose(1).p_WB.x(), 0, 1e-9);
  EXPECT_NEAR(world.com(2).x(), 1, 0.02);
  EXPECT_NEAR(world.velocity(2).x(), 1, 0.02);
  world.step(1.0 / 120);
  EXPECT_EQ(world.velocity(1), Vec3::Zero().eval());
}

TEST(RigidWorld, TurntableCarriesABoxRound) {
  RigidWorld world;
  RigidModel table = body(Cylinder{2, 0.1}, 0, 0.8);
  table.kind = RigidKind::kinematic;
  ASSERT_TRUE(world.add_body(0, table, {}));
  ASSERT_TRUE(world.add_body(1, body(Box{{0.2, 0.2, 0.2}}, 1, 0.8), at(1, 0.3, 0), {0, 0, -std::numbers::pi / 2},
                             {0, std::numbers::pi / 2, 0}));  // already turning with the table
  const double dt = 1.0 / 120;
  for (int i = 1; i <= 120; ++i) {  // a quarter turn in a second
    world.set_target(0, {Quat(Eigen::AngleAxisd(std::numbers::pi / 2 * i * dt, Vec3::UnitY())), Vec3::Zero()});
    world.step(dt);
  }
  EXPECT_LT((world.com(1) - Vec3(0, 0.3, -1)).norm(), 0.03);
}

TEST(RigidWorld, RestitutionMayChangeWhileBodiesTouch) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, fixed(Plane{}), {}));
  ASSERT_TRUE(world.add_body(1, body(Box{{0.5, 0.5, 0.5}}, 1), at(0, 0.5, 0)));
  for (int i = 0; i < 60; ++i) world.step(1.0 / 120);
  world.set_restitution(1, 0.8);
  world.set_velocity(1, {0, -2, 0}, Vec3::Zero());  // on contact points that are there already
  world.step(1.0 / 120);
  EXPECT_NEAR(world.velocity(1).y(), 1.6, 0.1);
}

TEST(RigidWorld, FastBallDoesNotPassAThinWall) {
  for (const double speed : {50.0, 300.0, 1000.0}) {
    RigidWorld world({.gravity = Vec3::Zero()});
    ASSERT_TRUE(world.add_body(0, fixed(Box{{0.005, 1, 1}}), {}));
    ASSERT_TRUE(world.add_body(1, body(Sphere{0.05}, 1, 0.5, 0.3), at(-3.3, 0, 0), {speed, 0, 0}));
    for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
    EXPECT_LT(world.com(1).x(), 0) << speed;
    EXPECT_NEAR(world.velocity(1).x(), -0.3 * speed, 1e-6 * speed);
  }
}

TEST(RigidWorld, SameCallsSameBits) {
  const auto run = [] {
    RigidWorld world;
    EXPECT_TRUE(world.add_body(0, fixed(Plane{}), {}));
    for (int i = 0; i < 30; ++i) {
      const Shape shapes[] = {Box{{0.3, 0.2, 0.4}}, Sphere{0.3}, Cylinder{0.2, 0.3},
                              ConvexHull{icosphere(0.3, 1).vertices}};
      const Pose pose{Quat(Eigen::AngleAxisd(i, Vec3(1, i % 3, 2).normalized())),
                      {0.1 * (i % 4), 0.5 + 0.5 * i, 0.07 * (i % 5)}};
      EXPECT_TRUE(world.add_body(i + 1, body(shapes[i % 4], 1 + i % 3, 0.5, 0.3), pose));
    }
    std::vector<double> state;
    for (int i = 0; i < 200; ++i) world.step(1.0 / 120);
    world.append_state(state);
    return state;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace crumple::sim
