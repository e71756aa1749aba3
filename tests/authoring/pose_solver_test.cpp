#include "server/authoring/pose_solver.h"

#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/k_means.h"
#include "server/authoring/shapes/box_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

namespace crumple::authoring {
namespace {

using sim::TetMesh;
using ::testing::HasSubstr;

// A bar of 2 x 0.3 x 0.3 along x with points on its axis, ends included.
struct Bar {
  TetMesh mesh = *centred_box_mesh({2, 0.3, 0.3}, {24, 4, 4}, Lattice::bcc);
  std::vector<Vec3> points;
  Eigen::MatrixXd W;

  explicit Bar(int handles) {
    Handles all;
    for (int b = 0; b < handles; ++b) {
      points.push_back({-1 + 2.0 * b / (handles - 1), 0, 0});
      all.handles.push_back(Handle::point(points.back()));
    }
    W = bounded_biharmonic_weights(mesh, all)->W;
  }
  PoseSolver solver(const PoseSolverOptions& options = {}) const { return *PoseSolver::make(mesh, W, points, options); }
};

Mat3 turn(double angle, const Vec3& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(); }

double angle_between(const Quat& a, const Mat3& b) { return a.angularDistance(Quat(b)); }

Vec3 placed(const SolvedPose& pose, int b, const Vec3& p) { return pose.bones[b].q * p + pose.bones[b].t; }

void expect_falling(const std::vector<double>& energies) {
  for (size_t k = 1; k < energies.size(); ++k) EXPECT_LT(energies[k], energies[k - 1]) << k;
}

// E as its definition has it, a rotation a tet, from the skinned positions alone. With groups of several tets it is
// less.
double definition(const Bar& bar, const SolvedPose& pose) {
  std::vector<Vec3> x(bar.mesh.X.size(), Vec3::Zero());
  for (size_t i = 0; i < x.size(); ++i)
    for (int b = 0; b < bar.W.cols(); ++b)
      x[i] += bar.W(static_cast<int>(i), b) * (pose.bones[b].q * bar.mesh.X[i] + pose.bones[b].t);
  double E = 0;
  for (int t = 0; t < bar.mesh.tet_count(); ++t) {
    Mat3 D, d;
    const Tet& tet = bar.mesh.tets[t];
    for (int k = 0; k < 3; ++k) {
      D.col(k) = bar.mesh.X[tet[k + 1]] - bar.mesh.X[tet[0]];
      d.col(k) = x[tet[k + 1]] - x[tet[0]];
    }
    const Mat3 F = d * D.inverse();
    const Eigen::JacobiSVD<Mat3> svd(F);
    Vec3 s = svd.singularValues();
    if (F.determinant() < 0) s[2] = -s[2];
    E += 0.5 * D.determinant() / 6 * (s - Vec3::Ones()).squaredNorm();
  }
  return E;
}

TEST(KMeans, SeparatesWhatIsApart) {
  Eigen::MatrixXd points(3, 60);
  for (int i = 0; i < 60; ++i) points.col(i) = Vec3::Unit(i % 3) + Vec3::Constant(0.001 * i);
  const Clusters three = k_means(points, 3);
  EXPECT_EQ(three.count, 3);
  for (int i = 0; i < 60; ++i) EXPECT_EQ(three.of[i], i % 3);
  EXPECT_EQ(k_means(Eigen::MatrixXd::Ones(2, 5), 4).count, 1);  // fewer different points than asked for
  EXPECT_EQ(k_means(points, 60).count, 60);
}

TEST(PoseSolver, ARigidMotionOfTheHandlesIsThatOfTheBody) {
  const Bar bar(5);
  const PoseSolver solver = bar.solver();
  for (const double angle : {0.3, 2.0, 3.1}) {
    const Mat3 R = turn(angle, {1, -2, 0.5});
    const Vec3 t(40, -3, 7);
    std::vector<HandleTarget> targets(5);
    for (int b = 0; b < 5; ++b) targets[b].position = R * bar.points[b] + t;
    targets[2].rotation = Quat(R);  // points on a line leave a turn open
    const auto pose = solver.solve(targets);
    ASSERT_TRUE(pose);
    EXPECT_TRUE(pose->report.converged);
    EXPECT_LT(pose->report.strain, 1e-6);
    for (int b = 0; b < 5; ++b) {
      EXPECT_LT(angle_between(pose->bones[b].q, R), 1e-6);
      EXPECT_LT((placed(*pose, b, Vec3(0.1, 0.2, 0.3)) - (R * Vec3(0.1, 0.2, 0.3) + t)).norm(), 1e-6);
    }
  }
}

TEST(PoseSolver, FollowsRigidlyWhereNothingHoldsAgainst) {
  const Bar bar(5);
  std::vector<HandleTarget> targets(5);
  targets[1] = {bar.points[1] + Vec3(1, 2, 3), std::nullopt};
  auto pose = bar.solver().solve(targets);  // one point dragged: all of the body goes with it
  ASSERT_TRUE(pose);
  EXPECT_LT(pose->report.strain, 1e-6);  // the energy to its rounding
  for (const auto& bone : pose->bones) {
    EXPECT_LT((bone.t - Vec3(1, 2, 3)).norm(), 1e-7);
    EXPECT_LT(angle_between(bone.q, Mat3::Identity()), 1e-7);
  }
  pose = bar.solver().solve(std::vector<HandleTarget>(5));  // nothing asked for: rest
  ASSERT_TRUE(pose);
  for (const auto& bone : pose->bones) EXPECT_LT(bone.t.norm() + angle_between(bone.q, Mat3::Identity()), 1e-12);
}

TEST(PoseSolver, APartialPoseIsKeptAndCompleted) {
  const Bar bar(5);
  std::vector<std::optional<sim::example_based::BoneTransform>> partial(5);
  partial[0] = {Quat(turn(0.4, Vec3::UnitZ())), Vec3(0.1, 0, 0)};
  partial[4] = {Quat(turn(-0.4, Vec3::UnitZ())), Vec3(-0.1, 0, 0)};
  const auto pose = bar.solver().solve(targets_of(partial, bar.points));
  ASSERT_TRUE(pose);
  for (const int b : {0, 4}) {
    EXPECT_LT(pose->bones[b].q.angularDistance(partial[b]->q), 1e-7);
    EXPECT_LT((pose->bones[b].t - partial[b]->t).norm(), 1e-12);
  }
  EXPECT_LT(angle_between(pose->bones[2].q, Mat3::Identity()), 0.02);  // between mirrored ends
}

// The end of a bar that is clamped at the other is dragged sideways, its rotation free: a cantilever under an end load,
// whose end turns by 3/2 of deflection over length (Euler and Bernoulli); slender enough that shear does not show. Only
// positions of the handles between are free, too.
TEST(PoseSolver, ADraggedEndBendsTheBarLikeACantilever) {
  const Bar bar(7);
  const double deflection = 0.1, length = 2;
  std::vector<HandleTarget> targets(7);
  targets[0] = {bar.points[0], Quat::Identity()};
  targets[6] = {bar.points[6] + Vec3(0, deflection, 0), std::nullopt};
  const auto pose = bar.solver({.rotation_groups = 256}).solve(targets);
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->report.converged) << pose->report.sweeps;
  expect_falling(pose->report.energies);
  const Vec3 along = pose->bones[6].q * Vec3::UnitX();
  EXPECT_NEAR(std::atan2(along.y(), along.x()), 1.5 * deflection / length, 0.15 * 1.5 * deflection / length);
  EXPECT_NEAR(along.z(), 0, 1e-3);
  for (int b = 0; b < 7; ++b) {  // deflection d (3 s^2 - s^3) / 2 at s of the length
    const double s = b / 6.0, y = placed(*pose, b, bar.points[b]).y();
    EXPECT_NEAR(y, deflection * (3 * s * s - s * s * s) / 2, 0.05 * deflection) << b;
  }
  std::printf("%d affine rounds, %d sweeps, strain %.4f\n", pose->report.affine_rounds, pose->report.sweeps,
              pose->report.strain);
}

// By symmetry the middle of a bar turns by half of what its end does.
TEST(PoseSolver, ATwistIsSharedEvenly) {
  const Bar bar(5);
  std::vector<HandleTarget> targets(5);
  targets[0] = {bar.points[0], Quat(turn(-0.5, Vec3::UnitX()))};
  targets[4] = {bar.points[4], Quat(turn(0.5, Vec3::UnitX()))};
  const auto pose = bar.solver().solve(targets);
  ASSERT_TRUE(pose);
  expect_falling(pose->report.energies);
  EXPECT_LT(angle_between(pose->bones[2].q, Mat3::Identity()), 5e-3);  // the lattice is not symmetric, nor are groups
  const Vec3 up = pose->bones[3].q * Vec3::UnitY();
  EXPECT_NEAR(std::atan2(up.z(), up.y()), 0.25, 0.05);
}

// A point dragged while the others are held where they are: rotations alone are found. No other rotations do better.
TEST(PoseSolver, HeldHandlesTurnForOneThatIsDragged) {
  const Bar bar(5);
  std::vector<HandleTarget> targets;
  for (const Vec3& p : bar.points) targets.push_back({p, std::nullopt});
  *targets[4].position += Vec3(0, 0.4, 0);
  const PoseSolver solver = bar.solver({.rotation_groups = 1000});
  const auto pose = solver.solve(targets);
  ASSERT_TRUE(pose);
  expect_falling(pose->report.energies);
  for (int b = 0; b < 5; ++b) EXPECT_LT((placed(*pose, b, bar.points[b]) - *targets[b].position).norm(), 1e-12);
  const Vec3 along = pose->bones[4].q * Vec3::UnitX();
  EXPECT_GT(std::atan2(along.y(), along.x()), 0.3);

  SolvedPose other = *pose;
  const double found = definition(bar, *pose);
  for (int b = 0; b < 5; ++b)
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1, 1}) {
        other.bones = pose->bones;
        other.bones[b].q = Quat(turn(0.05 * sign, Vec3::Unit(axis))) * pose->bones[b].q;
        other.bones[b].t = *targets[b].position - other.bones[b].q * bar.points[b];
        EXPECT_GT(definition(bar, other), found) << b << " " << axis;
      }
}

TEST(PoseSolver, EnergyIsThatOfItsDefinition) {
  const Bar bar(4);
  std::vector<HandleTarget> targets(4);
  for (int b = 0; b < 4; ++b)
    targets[b] = {bar.points[b] + 0.1 * Vec3(b % 2, b, -b), Quat(turn(0.2 * b, Vec3(1, b, 2)))};
  const auto pose = bar.solver({.rotation_groups = 1000}).solve(targets);
  ASSERT_TRUE(pose);
  const double E = definition(bar, *pose);
  EXPECT_GE(pose->report.energies.back(), E * (1 - 1e-12));  // tets of one group share a rotation
  EXPECT_LT(pose->report.energies.back(), 1.05 * E);
  const auto coarse = bar.solver({.rotation_groups = 4}).solve(targets);
  EXPECT_GT(coarse->report.energies.back(), pose->report.energies.back());
}

TEST(PoseSolver, HandlesInOnePlaceDoNotSpoilIt) {
  Bar bar(3);
  bar.points.push_back(bar.points[1]);
  Handles all;
  for (const Vec3& p : bar.points) all.handles.push_back(Handle::point(p));
  bar.W = bounded_biharmonic_weights(bar.mesh, all)->W;
  std::vector<HandleTarget> targets(4);
  targets[0] = {bar.points[0], Quat::Identity()};
  targets[2] = {bar.points[2] + Vec3(0, 0.5, 0), std::nullopt};
  const auto pose = bar.solver().solve(targets);
  ASSERT_TRUE(pose);
  expect_falling(pose->report.energies);
  EXPECT_LT((placed(*pose, 1, bar.points[1]) - placed(*pose, 3, bar.points[1])).norm(), 0.2);
  EXPECT_LT(pose->report.strain, 0.5);
}

TEST(PoseSolver, BadInputIsAnError) {
  const Bar bar(3);
  const auto text = [](const auto& r) { return r ? std::string("no error") : r.error().text(); };
  const auto of = [&](const PoseSolverOptions& o) { return text(PoseSolver::make(bar.mesh, bar.W, bar.points, o)); };
  EXPECT_THAT(of({.rotation_groups = -1}), HasSubstr("rotation_groups is -1"));
  EXPECT_THAT(of({.tolerance = 0}), HasSubstr("tolerance is 0"));
  EXPECT_THAT(of({.max_sweeps = 0}), HasSubstr("max_sweeps is 0"));
  EXPECT_THAT(text(PoseSolver::make(bar.mesh, bar.W, std::vector<Vec3>(2, Vec3::Zero()))), HasSubstr("points holds 2"));
  const PoseSolver solver = bar.solver();
  std::vector<HandleTarget> targets(2);
  EXPECT_THAT(text(solver.solve(targets)), HasSubstr("targets holds 2 targets, must hold 3"));
  targets.resize(3);
  targets[1].position = Vec3(0, std::nan(""), 0);
  EXPECT_THAT(text(solver.solve(targets)), HasSubstr("targets[1].position is not finite"));
  targets[1] = {std::nullopt, Quat(0, 0, 0, 0)};
  EXPECT_THAT(text(solver.solve(targets)), HasSubstr("targets[1].rotation must be finite and longer than 1e-6"));
}

// Prints milliseconds: made once a rig, solved once a drag.
TEST(PoseSolverSlow, ThirtyTwoHandles) {
  const TetMesh mesh = *centred_box_mesh({2, 1, 0.6}, {22, 11, 7}, Lattice::bcc);
  Handles handles;
  const auto points = points_of(mesh, place_handles(mesh, surface_nodes(mesh.tets), 32));
  for (const Vec3& p : points) handles.handles.push_back(Handle::point(p));
  const auto weights = bounded_biharmonic_weights(mesh, handles);
  ASSERT_TRUE(weights);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto ms = [](auto from, auto to) { return std::chrono::duration<double, std::milli>(to - from).count(); };
  const auto start = now();
  const auto solver = PoseSolver::make(mesh, weights->W, points);
  const auto made = now();
  std::vector<HandleTarget> targets(32);
  for (int b = 0; b < 32; ++b)
    if (points[b].x() < -0.5) targets[b].position = points[b];
  targets[31].position = points[31] + Vec3(0, 0.5, 0.2);
  const auto pose = solver->solve(targets);
  const auto solved = now();
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->report.converged);
  expect_falling(pose->report.energies);
  std::printf("%d vertices: made in %.0f ms, solved in %.1f ms: %d affine rounds, %d sweeps, strain %.3f\n",
              mesh.node_count(), ms(start, made), ms(made, solved), pose->report.affine_rounds, pose->report.sweeps,
              pose->report.strain);
}

}  // namespace
}  // namespace crumple::authoring
