#include <gtest/gtest.h>

#include <numbers>

#include "tests/sim/islands/soft_scene.h"

namespace crumple::sim::islands {
namespace {

constexpr double kGravity = 9.81;
constexpr std::array<int, 3> kCells{2, 2, 2};
const Vec3 kUnit = Vec3::Ones();

double lowest(const SoftBody& body) {
  double y = body.state.x[0].y();
  for (const Vec3& x : body.state.x) y = std::min(y, x.y());
  return y;
}

// FORMULAS F5: a stiff block of 1 m^3 that just overlaps the ground, damping only.
TEST(RawDamping, LandingBlockLosesSpeedByTheClosedForm) {
  for (const double phi : {1e4, 1e5, 1e6}) {
    SoftScene scene;
    scene.gravity.setZero();
    scene.settings.raw_damping = true;
    scene.settings.phi = phi;
    scene.friction = 0;
    scene.add_plane(Vec3::UnitY(), 0);
    SoftBody& block = scene.add_soft(kCells, kUnit, Vec3(0, -1e-4, 0), Vec3(0, -1, 0), 1e11);
    scene.solve = {1e-9, 5000};
    scene.step();
    EXPECT_NEAR(block.velocity().y(), -1 / (1 + scene.dt * phi * 1 / 1000), 2e-4) << phi;
  }
}

TEST(RawDamping, RestingBlockSinksForEverAtTheClosedFormsSpeed) {
  for (const double phi : {1e6, 1e7}) {
    SoftScene scene;
    scene.settings.raw_damping = true;
    scene.settings.phi = phi;
    scene.add_plane(Vec3::UnitY(), 0);
    SoftBody& block = scene.add_soft(kCells, kUnit, Vec3(0, -1e-4, 0), Vec3::Zero(), 1e8);
    scene.run(1.0);
    const double y0 = block.centre().y();
    scene.run(1.0);
    const double sink = 1000 * kGravity / phi;  // 9.8 and 0.98 mm/s
    EXPECT_NEAR(y0 - block.centre().y(), sink, 0.01 * sink) << phi;
  }
}

TEST(Recovery, RestingBlockStaysWhereItIs) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft(kCells, kUnit, Vec3(0, 0.05, 0));
  scene.run(3);
  const double y0 = block.centre().y();
  EXPECT_LT(block.rms_speed(), 1e-3);
  EXPECT_LT(std::abs(lowest(block)), 5e-3);  // static overlap m g dt tau / (kappa m): 0.1 mm, more where it tilts
  scene.run(5);
  EXPECT_LT(block.rms_speed(), 1e-4);
  EXPECT_LT(std::abs(block.centre().y() - y0), 1e-4);
  double weight = 0;
  for (const contact::ContactRow& row : scene.islands[0].rows) weight += row.impulse().y();
  EXPECT_NEAR(weight, 1000 * kGravity * scene.dt, 1e-2 * 1000 * kGravity * scene.dt);
}

TEST(Recovery, HealsAnOverlapAtTheBoundedSpeed) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft(kCells, kUnit, Vec3(0, -0.3, 0));
  for (int k = 0; k < 120; ++k) {
    scene.step();
    EXPECT_LT(block.velocity().y(), 1.25);  // 1 m/s and what the compressed block adds
  }
  EXPECT_GT(lowest(block), -0.01);
  EXPECT_LT(block.rms_speed(), 0.02);
}

// Edges that come and go keep a stack moving by some mm/s at the default kappa = 100, tau = 4 dt (a fraction of a
// millimetre), as CONTACT.md's prototype; kappa = 300, tau = 8 dt is for where rest matters.
TEST(Recovery, StackOfTwoStays) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& lower = scene.add_soft(kCells, kUnit, Vec3(0, 0.01, 0));
  SoftBody& upper = scene.add_soft(kCells, kUnit, Vec3(0.1, 1.05, 0.05));
  scene.run(3);
  const Vec3 x0 = upper.centre();
  double pressed = 0, worst = 0;
  for (int k = 0; k < 120; ++k) {
    scene.step();
    worst = std::max({worst, lower.rms_speed(), upper.rms_speed()});
    for (const contact::ContactRow& row : scene.islands[0].rows)
      if (row.sides[1].body == 1) pressed -= row.impulse().y();  // on the lower cube
  }
  EXPECT_LT(worst, 0.03);
  EXPECT_LT((upper.centre() - x0).norm(), 3.5e-3);  // 2.98 to 3.13 mm by twelve starts a micrometre apart
  EXPECT_GT(lowest(upper), 0.97);
  EXPECT_NEAR(pressed / 120, 1000 * kGravity * scene.dt, 0.01 * 1000 * kGravity * scene.dt);  // F8, in the mean
}

// The nodes of a flat face under load must not take turns, up in one step and down in the next.
TEST(Recovery, FaceUnderAHeavyRigidBoxDoesNotChatter) {
  for (const double mass : {3000.0, 6000.0}) {
    SoftScene scene;
    scene.add_plane(Vec3::UnitY(), 0);
    SoftBody& block = scene.add_soft(kCells, kUnit, Vec3(0, 0, 0));
    scene.add_rigid(Vec3(1.2, 1, 1.2), Vec3(0.6, 1.52, 0.55), mass, true);
    scene.run(5);
    double worst = 0;
    for (int k = 0; k < 60; ++k) {
      scene.step();
      for (std::size_t n = 0; n < block.state.v.size(); ++n)
        if (block.state.x[n].y() < 0.1) worst = std::max(worst, block.state.v[n].norm());
    }
    EXPECT_LT(worst, 5e-3) << mass;  // 0.4 and 1 m/s with a row a tet, at the centroid of what is below
  }
}

// Four cells a side: on two, of which the box's edges press single nodes, twice the block's weight chatters by
// a millimetre (c depends on the predicted overlap, and that on the velocity: an explicit loop).
TEST(Recovery, RigidBoxStaysOnASoftBlock) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft({4, 4, 4}, kUnit, Vec3(0, 0, 0));
  RigidBox& box = scene.add_rigid(Vec3(0.6, 0.4, 0.6), Vec3(0.5, 1.25, 0.5), 2000, true);
  scene.run(2);
  Vec3 on_box = Vec3::Zero();
  double worst = 0;
  for (int k = 0; k < 60; ++k) {
    scene.step();
    worst = std::max({worst, box.v.norm(), 0.3 * box.w.norm()});
    for (const ContactImpulse& impulse : scene.solutions[0].impulses) on_box += impulse.impulse_W;
  }
  const double weight = 2000 * kGravity * scene.dt;
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(block.rms_speed(), 0.02);
  EXPECT_GT(box.p.y(), 1.1);  // twice the block's weight bends it by centimetres
  EXPECT_LT(box.p.y(), 1.2);
  EXPECT_LT((on_box / 60 - Vec3(0, weight, 0)).norm(), 0.01 * weight);
}

TEST(Recovery, SoftCubeRestsOnAFixedRigidBox) {
  SoftScene scene;
  scene.add_rigid(Vec3(2, 1, 2), Vec3(0.5, -0.5, 0.5), 1, false);
  SoftBody& cube = scene.add_soft(kCells, kUnit, Vec3(0, 0.02, 0));
  scene.run(4);
  EXPECT_LT(cube.rms_speed(), 1e-3);
  EXPECT_GT(lowest(cube), -0.02);
  EXPECT_TRUE(scene.solutions[0].rigid.empty());
}

// ---- friction, FORMULAS F7: the slope is a tilted gravity --------------------------------------------------------
struct Slope {
  SoftScene scene;
  SoftBody* block;

  Slope(double degrees, double mu, double kappa = 100, double recovery_steps = 4) {
    scene.settings.kappa = kappa;
    scene.settings.recovery_steps = recovery_steps;
    const double a = degrees * std::numbers::pi / 180;
    scene.gravity = kGravity * Vec3(std::sin(a), -std::cos(a), 0);
    scene.friction = mu;
    scene.add_plane(Vec3::UnitY(), 0);
    block = &scene.add_soft(kCells, Vec3(1, 0.5, 1), Vec3(0, 0, 0), Vec3::Zero(), 1e8);
    scene.run(0.2);  // settles
  }
};

TEST(CoulombFriction, BlockSlidesAtTheClosedFormsAcceleration) {
  for (const double mu : {0.5, 0.3}) {
    Slope slope(30, mu);
    const double v0 = slope.block->velocity().x();
    slope.scene.run(1.0);
    const double a = 0.5 * kGravity - mu * kGravity * std::cos(std::numbers::pi / 6);  // .65715, 2.35629
    EXPECT_NEAR(slope.block->velocity().x() - v0, a, 0.03 * a) << mu;
  }
}

// Drift per second along a slope, after landing.
double drift(double degrees, double kappa, double recovery_steps) {
  Slope slope(degrees, 0.5, kappa, recovery_steps);
  slope.scene.run(2.0);  // at 26 degrees friction is 2 % stronger than gravity: landing takes its time to stop
  const double x0 = slope.block->centre().x();
  slope.scene.run(3.0);
  return std::abs(slope.block->centre().x() - x0) / 3;
}

TEST(CoulombFriction, BlockSticksBelowTheAngleOfFriction) {
  EXPECT_LT(drift(15, 100, 4), 1e-6);
  EXPECT_LT(drift(26, 300, 8), 1e-4);  // F7: 1 mm in 10 s, 0.6 degrees below the angle of friction
}

// The default law does not meet F7's 1 mm in 10 s at 26 degrees: it drifts 1.02 mm (15 degrees: nothing). Rows there are
// at their cones and hand what they cannot hold to each other from step to step.
TEST(CoulombFriction, DefaultLawCreepsCloseToTheAngleOfFriction) { EXPECT_LT(drift(26, 100, 4), 2e-4); }

TEST(CoulombFriction, BlockSlidesAboveTheAngleOfFriction) {
  Slope slope(27.1, 0.5);
  const double x0 = slope.block->centre().x();
  slope.scene.run(3.0);
  EXPECT_GT(slope.block->centre().x() - x0, 0.1);
}

TEST(CoulombFriction, SlidingBlockStopsAndStays) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft(kCells, Vec3(1, 0.5, 1), Vec3(0, 0, 0), Vec3(2, 0, 0), 1e8);
  const double x0 = block.centre().x();
  scene.run(1.0);
  EXPECT_LT(std::abs(block.velocity().x()), 1e-3);
  EXPECT_NEAR(block.centre().x() - x0, 2 * 2 / (2 * 0.5 * kGravity), 0.04);  // v^2 / (2 mu g), to a step at 2 m/s
}

TEST(CoulombFriction, HoldsABlockPressedToAWall) {  // where the paper's heuristic lets it fall
  SoftScene scene;
  scene.gravity = Vec3(-40, -kGravity, 0);  // 1 kg pressed by 40 N against the wall x = 0
  scene.add_plane(Vec3::UnitX(), 0);
  SoftBody& block = scene.add_soft(kCells, Vec3::Constant(0.1), Vec3(0, 0, 0));
  EXPECT_NEAR(block.mass(), 1, 1e-12);
  scene.run(0.5);
  const double y0 = block.centre().y();
  scene.run(2);
  EXPECT_LT(std::abs(block.centre().y() - y0), 3e-4);
}

}  // namespace
}  // namespace crumple::sim::islands
