#include "server/sim/example_based/impulse_projection.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(ImpulseProjection, OnlyWhatExceedsTheYieldMoves) {  // eq. 4
  const Vec3 j(0, -3, 4);
  EXPECT_LT((plastic_displacement(j, 0.004, 2, 1) - 0.004 / 2 * 4 * j / 5).norm(), 1e-18);
  EXPECT_EQ(plastic_displacement(j, 0.004, 2, 5), Vec3::Zero());
  EXPECT_EQ(plastic_displacement(j, 0.004, 2, 6), Vec3::Zero());
  EXPECT_EQ(plastic_displacement(Vec3::Zero(), 0.004, 2, 0), Vec3::Zero());
}

TEST(ImpulseProjection, RawRatesScaleWithTheStepAndTheDefaultDoesNot) {
  ExampleParameters p;
  EXPECT_EQ(projection_dt(p, 0.001, 0.004), 0.004);
  p.raw_rates = true;
  EXPECT_EQ(projection_dt(p, 0.001, 0.004), 0.001);
}

TEST(ImpulseProjection, Equation8StepsByAlphaTimesTheDisplacement) {  // FORMULAS F13
  std::mt19937 random(5);
  ExampleParameters p;
  p.alpha = 25;
  for (int n = 0; n < 50; ++n) {
    Jacobian J(3, 4);
    for (int e = 0; e < 4; ++e) J.col(e) = random_vector(random);
    const Vec3 dx = 0.01 * random_vector(random).normalized();
    const WeightRow de = weight_change(p, J, dx);
    EXPECT_NEAR(de.norm(), 0.25, 1e-14);
    const WeightRow gradient = J.transpose() * dx;
    EXPECT_NEAR(de.dot(gradient), de.norm() * gradient.norm(), 1e-14);
  }
}

TEST(ImpulseProjection, OrthogonalImpulsesDoNothingAtAnyScale) {  // STABILITY 31
  ExampleParameters p;
  for (double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    Jacobian J(3, 3);
    J.col(0).setZero();
    J.col(1) = scale * Vec3(1, 0, 0);
    J.col(2) = scale * Vec3(0.3, 0, 2);
    for (const Vec3& j : {Vec3(0, 1, 0), Vec3(1e-7, 1, 1e-8)})
      EXPECT_EQ(weight_change(p, J, scale * 1e-3 * j).norm(), 0) << scale;
    // and one that is not orthogonal deforms at every scale: |de| = alpha |dx|
    const Vec3 dx = scale * 1e-3 * Vec3(1, 0.2, 0);
    EXPECT_NEAR(weight_change(p, J, dx).norm(), p.alpha * dx.norm(), 1e-12 * p.alpha * dx.norm()) << scale;
  }
  EXPECT_EQ(weight_change(p, Jacobian::Zero(3, 3), Vec3(1, 2, 3)).norm(), 0);
  EXPECT_EQ(weight_change(p, Jacobian::Random(3, 3), Vec3::Zero()).norm(), 0);
}

TEST(ImpulseProjection, RawThresholdIsThePapers) {
  ExampleParameters p;
  p.raw_rates = true;
  Jacobian J(3, 1);
  J.col(0) = Vec3(1, 0, 0);
  EXPECT_EQ(weight_change(p, J, Vec3(0.9e-8, 0, 0)).norm(), 0);
  EXPECT_GT(weight_change(p, J, Vec3(1.1e-8, 0, 0)).norm(), 0);
}

TEST(ImpulseProjection, Equation9InvertsAWellConditionedJacobian) {
  std::mt19937 random(6);
  ExampleParameters p;
  p.step = ExampleParameters::Step::equation9;
  p.raw_rates = true;
  p.alpha = 1;
  for (int n = 0; n < 50; ++n) {
    Jacobian J(3, 5);
    for (int e = 0; e < 5; ++e) J.col(e) = random_vector(random);
    const Vec3 dx = random_vector(random);
    const WeightRow de = weight_change(p, J, dx);
    EXPECT_LT((J * de - dx).norm(), 1e-6);  // squares the condition, up to 1e2 or so here
    // the shortest such change: it lies in the row space, as Moore and Penrose have it
    EXPECT_LT((de - J.completeOrthogonalDecomposition().pseudoInverse() * dx).norm(), 1e-6);
  }
}

TEST(ImpulseProjection, OnlyEquation9NeedsAThreshold) {  // STABILITY 33
  const Mat3 U = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())).toRotationMatrix();
  const Jacobian J = U * Vec3(1, 1e-6, 1e-12).asDiagonal() * U.transpose();
  const Vec3 dx = U * Vec3(0.01, 0.01, 0.01);
  ExampleParameters p;
  p.alpha = 1;
  EXPECT_NEAR(weight_change(p, J, dx).norm(), dx.norm(), 1e-12);
  p.step = ExampleParameters::Step::equation9;
  const double bounded = weight_change(p, J, dx).norm();
  EXPECT_GT(bounded, 0.5 * 0.01);
  EXPECT_LE(bounded, dx.norm() / (2 * kTikhonov));
  p.raw_rates = true;  // thresholded: the middle one sits at the threshold, and which side decides a factor of 1e6
  EXPECT_TRUE(weight_change(p, J, dx).allFinite());
  EXPECT_LE(weight_change(p, J, dx).norm(), dx.norm() / kRawThreshold * 1.1);
  p.step = ExampleParameters::Step::equation10;
  EXPECT_NEAR(weight_change(p, J, dx).norm(), 0.01, 1e-6);
}

TEST(ImpulseProjection, Equation10IsTheGradient) {
  ExampleParameters p;
  p.step = ExampleParameters::Step::equation10;
  p.alpha = 3;
  const Jacobian J = Jacobian::Random(3, 4);
  const Vec3 dx(0.1, -0.2, 0.3);
  EXPECT_LT((weight_change(p, J, dx) - 3 * J.transpose() * dx).norm(), 1e-15);
}

}  // namespace
}  // namespace crumple::sim::example_based
