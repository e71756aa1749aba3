#include "server/sim/islands/projected_start.h"

#include <gtest/gtest.h>

#include "tests/sim/islands/soft_scene.h"

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;

// A beam that is held at one end and swings, with its velocities one step back.
struct Swinging {
  SoftScene scene;
  std::vector<Vec3> v_before;

  Swinging() {
    SoftBody& beam = scene.add_soft({8, 2, 2}, Vec3(1.6, 0.4, 0.4), Vec3::Zero());
    for (std::size_t i = 0; i < beam.mesh.X.size(); ++i)
      if (beam.mesh.X[i].x() < 1e-9) beam.prescribed.push_back({static_cast<int>(i), Vec3(0, 0, 0.1)});
    scene.solve.tolerance = 1e-10;
    for (int k = 0; k < 20; ++k) {
      v_before = beam.state.v;
      scene.step();
    }
  }
};

// The island of its one body.
struct Start {
  std::vector<IslandBody> bodies;
  std::vector<CompositeIsland> islands;
  IslandSystem system;
  VectorXd b, x, r;

  explicit Start(Swinging& swinging) : bodies(swinging.scene.assemble()), islands(composite_islands(bodies, {})), system(islands[0], bodies) {
    bodies[0].v_before = &swinging.v_before;
    system.fill(b, x);
    r.resize(x.size());
  }
  void project() { ProjectedStart().project(system, bodies[0], b, ThreadPool(1), x, r); }
  VectorXd residual_of(const VectorXd& at) const {
    VectorXd Ax(at.size());
    system.multiply(at, Ax, ThreadPool(1));
    return b - Ax;
  }
  VectorXd free_part(VectorXd v) const {
    for (int i = 0; i < bodies[0].system->node_count(); ++i)
      if (bodies[0].system->prescribed[i]) v.segment<3>(3 * i).setZero();
    return v;
  }
};

// Nearest in the norm of A: what is missing is orthogonal to all that it may move by.
TEST(ProjectedStart, IsTheNearestOfAllThatTwoStepsSay) {
  Swinging swinging;
  Start start(swinging);
  const VectorXd level = start.free_part(start.x);
  const VectorXd change = start.free_part(start.x - Eigen::Map<const VectorXd>(swinging.v_before[0].data(), start.x.size()));
  const VectorXd before = start.residual_of(start.x);
  ASSERT_TRUE(ProjectedStart().applies(start.islands[0], start.bodies));
  start.project();
  EXPECT_LT((start.r - start.residual_of(start.x)).norm(), 1e-12 * start.b.norm());
  EXPECT_LT(std::abs(level.dot(start.r)), 1e-9 * level.norm() * before.norm());
  EXPECT_LT(std::abs(change.dot(start.r)), 1e-9 * change.norm() * before.norm());
  EXPECT_LT(start.r.norm(), 0.2 * before.norm());
  for (const fem::PrescribedNode& p : swinging.scene.soft[0].prescribed) {
    EXPECT_EQ(start.x.segment<3>(3 * p.node), p.velocity);
    EXPECT_EQ(start.r.segment<3>(3 * p.node), Vec3::Zero());
  }
}

TEST(ProjectedStart, OfWhatStandsOrMovesEvenlyLosesNothing) {
  for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1, 2, 3)}) {
    SoftScene scene;
    SoftBody& block = scene.add_soft({2, 2, 2}, Vec3::Ones(), Vec3::Zero(), v);
    block.prescribed = {{24, v}, {25, v}, {26, v}};
    block.state.x[0].x() += 0.01;
    const std::vector<Vec3> before = block.state.v;
    std::vector<IslandBody> bodies = scene.assemble();
    std::vector<CompositeIsland> islands = composite_islands(bodies, {});
    const IslandOptions options{.solve = {1e-12, 1000}};
    const IslandSolution without = solve(islands[0], bodies, options, {}, ThreadPool(1));
    bodies[0].v_before = &before;
    const IslandSolution with = solve(islands[0], bodies, options, {}, ThreadPool(1));
    ASSERT_TRUE(with.finite);
    EXPECT_LT((with.velocity - without.velocity).norm(), 1e-10 * without.velocity.norm()) << v.x();
    EXPECT_LE(with.report.iterations, without.report.iterations + 1);
  }
}

TEST(ProjectedStart, IsOfHeldBodiesThatTouchNothing) {
  SoftScene scene;
  scene.add_soft({2, 2, 2}, Vec3::Ones(), Vec3(0, -0.001, 0)).prescribed = {{24, Vec3::Zero()}, {25, Vec3::Zero()}, {26, Vec3::Zero()}};
  const std::vector<Vec3> before = scene.soft[0].state.v;
  std::vector<IslandBody> bodies = scene.assemble();
  std::vector<CompositeIsland> islands = composite_islands(bodies, {});
  EXPECT_FALSE(ProjectedStart().applies(islands[0], bodies));  // its first step
  bodies[0].v_before = &before;
  EXPECT_TRUE(ProjectedStart().applies(islands[0], bodies));
  bodies[0].has_start = true;
  EXPECT_FALSE(ProjectedStart().applies(islands[0], bodies));
  bodies[0].has_start = false;
  const std::vector<Vec3> of_fewer(before.begin(), before.end() - 1);  // it has split since
  bodies[0].v_before = &of_fewer;
  EXPECT_FALSE(ProjectedStart().applies(islands[0], bodies));
  bodies[0].v_before = &before;
  scene.add_plane(Vec3::UnitY(), 0);
  scene.detect();
  islands = composite_islands(bodies, scene.rows);
  ASSERT_FALSE(islands[0].rows.empty());
  EXPECT_FALSE(ProjectedStart().applies(islands[0], bodies));

  scene.soft[0].prescribed.pop_back();  // a hinge
  std::vector<IslandBody> free = scene.assemble();
  free[0].v_before = &before;
  islands = composite_islands(free, {});
  EXPECT_FALSE(ProjectedStart().applies(islands[0], free));
  scene.soft[0].prescribed.clear();
  free = scene.assemble();
  free[0].v_before = &before;
  EXPECT_FALSE(ProjectedStart().applies(islands[0], free));
}

// A body that came apart, of which one piece is held and the other flies.
TEST(ProjectedStart, IsNotWherePiecesFly) {
  SoftScene scene;
  TetMesh two = block_mesh({1, 1, 1}, Vec3::Ones());
  const TetMesh one = two;
  const int n = one.node_count();
  for (const Vec3& X : one.X) two.X.push_back(X + Vec3(3, 0, 0));
  for (const Tet& tet : one.tets) two.tets.push_back({tet[0] + n, tet[1] + n, tet[2] + n, tet[3] + n});
  SoftBody& body = scene.add_mesh(two, {}, Vec3::Zero());
  for (int i = 0; i < 4; ++i) body.prescribed.push_back({i, Vec3::Zero()});
  const std::vector<Vec3> before = body.state.v;
  std::vector<IslandBody> bodies = scene.assemble();
  bodies[0].v_before = &before;
  const std::vector<CompositeIsland> islands = composite_islands(bodies, {});
  EXPECT_FALSE(ProjectedStart().applies(islands[0], bodies));
  for (int i = 0; i < 4; ++i) body.prescribed.push_back({n + i, Vec3::Zero()});
  bodies = scene.assemble();
  bodies[0].v_before = &before;
  EXPECT_TRUE(ProjectedStart().applies(islands[0], bodies));
}

}  // namespace
}  // namespace crumple::sim::islands
