// Friction by the island's weight, beside Coulomb's.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <numbers>

#include "tests/sim/islands/soft_scene.h"

namespace crumple::sim::islands {
namespace {

constexpr double kGravity = 9.81, kMu = 0.5;
constexpr double kStiff = 1e8;  // [Pa]: does not bounce
const Vec3 kUnit = Vec3::Ones();

SoftScene scene_with(FrictionLaw law) {
  SoftScene scene;
  scene.settings.friction = law;
  scene.friction = kMu;
  return scene;
}

void tilt(SoftScene& scene, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  scene.gravity = kGravity * Vec3(std::sin(angle), -std::cos(angle), 0);
}

// One block rests with its weight on its contacts, so that the heuristic is Coulomb's force: mu g.
TEST(WeightFriction, ASlidingBlockIsSlowedByMuG) {
  SoftScene scene = scene_with(FrictionLaw::weight_heuristic);
  scene.dt = 1.0 / 240;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft({2, 2, 2}, kUnit, Vec3(0, -1e-4, 0), Vec3(3, 0, 0), kStiff);
  scene.run(0.4);
  EXPECT_NEAR(block.velocity().x(), 3 - kMu * kGravity * 0.4, 0.05);
}

TEST(WeightFriction, ForcesOfAnIslandSumToMuTimesItsWeight) {
  SoftScene scene = scene_with(FrictionLaw::weight_heuristic);
  scene.add_plane(Vec3::UnitY(), 0);
  scene.add_soft({2, 2, 2}, kUnit, Vec3(0, -1e-3, 0), Vec3(3, 0, 0));
  scene.add_soft({2, 2, 2}, kUnit, Vec3(0, 0.998, 0), Vec3(-3, 0, 0));
  scene.step();
  ASSERT_EQ(scene.islands.size(), 1u);
  double force = 0;  // at the speed of the start; contacts are level to the tilt of their rows
  for (const contact::ContactRow& row : scene.islands[0].rows)
    if (row.active) force += row.c_t * (row.sides[1].body == 2 ? 3 : 6) / scene.dt;
  EXPECT_NEAR(force, kMu * 2000 * kGravity, 0.02 * force);
}

TEST(WeightFriction, NothingHoldsABlockBetweenWalls) {
  for (const FrictionLaw law : {FrictionLaw::coulomb, FrictionLaw::weight_heuristic}) {
    SoftScene scene = scene_with(law);
    scene.add_plane(Vec3::UnitX(), 0.02);  // 4 % of E = 1e6 on 1 m^2: 40 kN on either side of 9.8 kN
    scene.add_plane(-Vec3::UnitX(), -0.98);
    SoftBody& block = scene.add_soft({2, 2, 2}, kUnit, Vec3::Zero());
    scene.run(0.5);
    if (law == FrictionLaw::coulomb) EXPECT_NEAR(block.velocity().y(), 0, 0.01);
    else EXPECT_NEAR(block.velocity().y(), -kGravity * 0.5, 0.02 * kGravity);
  }
}

// c_t = c_n there: the block creeps at g sin(slope) dt / kappa. Coulomb's rows hold it.
TEST(WeightFriction, ABlockCreepsOnASlopeThatHoldsIt) {
  for (const FrictionLaw law : {FrictionLaw::coulomb, FrictionLaw::weight_heuristic}) {
    SoftScene scene = scene_with(law);
    tilt(scene, 15);
    scene.add_plane(Vec3::UnitY(), 0);
    SoftBody& block = scene.add_soft({2, 2, 2}, kUnit, Vec3(0, -1e-4, 0), Vec3::Zero(), 1e7);
    scene.run(2);
    const double from = block.centre().x();
    scene.run(2);
    const double speed = (block.centre().x() - from) / 2, creep = kGravity * 0.2588 * scene.dt / 100;  // 0.42 mm/s
    if (law == FrictionLaw::coulomb) EXPECT_NEAR(speed, 0, 0.02 * creep);
    else EXPECT_NEAR(speed, creep, 0.15 * creep);
  }
}

TEST(WeightFriction, ABlockSlidesDownASteeperSlope) {
  SoftScene scene = scene_with(FrictionLaw::weight_heuristic);
  tilt(scene, 40);
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& block = scene.add_soft({2, 2, 2}, kUnit, Vec3(0, -1e-4, 0), Vec3::Zero(), kStiff);
  scene.run(1);
  const double from = block.velocity().x();
  scene.run(1);
  const double angle = 40 * std::numbers::pi / 180, expected = kGravity * (std::sin(angle) - kMu * std::cos(angle));
  EXPECT_NEAR(block.velocity().x() - from, expected, 0.05 * expected);
}

TEST(WeightFriction, ItsTermIsSymmetricAndTakesEnergy) {
  SoftScene scene = scene_with(FrictionLaw::weight_heuristic);
  scene.add_plane(Vec3::UnitY(), 0);
  scene.add_soft({1, 1, 1}, kUnit, Vec3(0, -1e-3, 0), Vec3(3, 0, 1));
  scene.add_soft({1, 1, 1}, kUnit, Vec3(0.3, 0.998, 0), Vec3(-3, 0, 0));
  scene.step();
  std::vector<contact::ContactRow> rows = scene.islands[0].rows;
  const std::vector<int> first_block{0, 8, -1};
  const contact::ContactRows system(rows, first_block, 16);
  std::vector<Eigen::Triplet<double>> entries;
  system.append_to(entries);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(48, 48);
  for (const auto& e : entries) A(e.row(), e.col()) += e.value();
  EXPECT_LT((A - A.transpose()).norm(), 1e-12 * A.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues().minCoeff(), -1e-12 * A.norm());
}

// How far the top of a stack of three has gone down a slope after 5 s [m].
double top_of_three(FrictionLaw law, double degrees) {
  SoftScene scene = scene_with(law);
  tilt(scene, degrees);
  scene.add_plane(Vec3::UnitY(), 0);
  for (int k = 0; k < 3; ++k) scene.add_soft({2, 2, 2}, kUnit, Vec3(0, k * 1.0 - 1e-4, 0), Vec3::Zero(), 1e7);
  scene.run(5);
  return scene.soft[2].centre().x() - 0.5;
}

// Weight is shared by volume of overlap, not by who bears it: where blocks lie on each other it may be next to nothing. On
// level ground a stack stands, because what is at rest has c_t = c_n; where it is pushed sideways it goes.
TEST(WeightFriction, AStackOfThreeStandsOnLevelGroundAndFallsWhereCoulombHoldsIt) {
  EXPECT_LT(std::abs(top_of_three(FrictionLaw::weight_heuristic, 0)), 0.03);
  EXPECT_LT(std::abs(top_of_three(FrictionLaw::coulomb, 0)), 0.03);
  EXPECT_LT(std::abs(top_of_three(FrictionLaw::coulomb, 10)), 0.03);
  EXPECT_GT(top_of_three(FrictionLaw::weight_heuristic, 10), 0.5);
}

}  // namespace
}  // namespace crumple::sim::islands
