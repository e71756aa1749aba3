#include "server/sim/islands/composite_island.h"

#include <gtest/gtest.h>

#include "tests/sim/islands/soft_scene.h"

namespace crumple::sim::islands {
namespace {

constexpr std::array<int, 3> kCells{2, 2, 2};
const Vec3 kUnit = Vec3::Ones();

TEST(CompositeIslands, AreBodiesThatTouchAndNotThoseThatShareTheGround) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  scene.add_soft(kCells, kUnit, Vec3(0, -0.001, 0));   // 0: on the ground, alone
  scene.add_soft(kCells, kUnit, Vec3(5, -0.001, 0));   // 1: on the ground, carries 2 and box 4
  scene.add_soft(kCells, kUnit, Vec3(5, 0.998, 0));    // 2
  scene.add_soft(kCells, kUnit, Vec3(-5, 3, 0));       // 3: in the air
  scene.add_rigid(kUnit, Vec3(5.5, 2.495, 0.5), 100, true);     // 4
  scene.add_rigid(kUnit, Vec3(20, 2, 0), 100, true);            // 5: touches nothing
  scene.add_rigid(kUnit, Vec3(-0.49, 0.5, 0.5), 100, false);    // 6: fixed, beside 0
  scene.step();
  ASSERT_EQ(scene.islands.size(), 3u);
  EXPECT_EQ(scene.islands[0].soft, std::vector<int>{0});
  EXPECT_TRUE(scene.islands[0].rigid.empty());
  EXPECT_EQ(scene.islands[1].soft, (std::vector<int>{1, 2}));
  EXPECT_EQ(scene.islands[1].rigid, std::vector<int>{4});
  EXPECT_EQ(scene.islands[2].soft, std::vector<int>{3});
  EXPECT_TRUE(scene.islands[2].rows.empty());
  std::size_t rows = 0;
  for (const CompositeIsland& island : scene.islands) rows += island.rows.size();
  EXPECT_EQ(rows, scene.rows.size());
  bool against_fixed = false;
  for (const contact::ContactRow& row : scene.islands[0].rows) against_fixed |= row.sides[1].body == 6;
  EXPECT_TRUE(against_fixed);
}

TEST(CompositeIslands, MovableRigidBodyOnSomethingFixedIsOneOfItsOwn) {
  std::vector<IslandBody> bodies(2);  // 1: held, or asleep
  bodies[0].rigid = RigidPart{.mass = 2, .b_v = Vec3(0, -2, 0)};
  contact::ContactRow row;
  row.sides[0] = {.body = 0, .tet = 0, .rigid = true};
  row.sides[1] = {.body = 1, .tet = 0};
  row.c_n = 1e6;
  std::vector<CompositeIsland> islands = composite_islands(bodies, std::vector{row});
  ASSERT_EQ(islands.size(), 1u);
  EXPECT_EQ(islands[0].rigid, std::vector<int>{0});
  const IslandSolution solution = solve(islands[0], bodies, {}, {}, ThreadPool(1));
  EXPECT_NEAR(solution.rigid.at(0).v.y(), 0, 1e-5);
}

TEST(CompositeIslands, BodyAloneIsTheSystemOfTheFiniteElementRoom) {
  SoftScene scene;
  SoftBody& body = scene.add_soft(kCells, kUnit, Vec3::Zero());
  for (std::size_t i = 0; i < body.state.x.size(); ++i) body.state.x[i].x() *= 1.1;
  SoftBody copy = body;
  scene.step();
  fem::StepScratch scratch;
  Eigen::VectorXd f(3 * copy.state.x.size());
  for (std::size_t i = 0; i < copy.state.x.size(); ++i) f.segment<3>(3 * i) = copy.rest.node_mass[i] * scene.gravity;
  const fem::StepOptions options{scene.dt, scene.dt, scene.solve};
  fem::implicit_euler_step(copy.rest, copy.mesh.tets, copy.state, f, {}, options, *scene.pool, scratch);
  for (std::size_t i = 0; i < copy.state.x.size(); ++i)
    EXPECT_LT((body.state.v[i] - copy.state.v[i]).norm(), 1e-13);  // not to the bit: sums of another order
}

TEST(CompositeIslands, ImpactConservesMomentum) {
  SoftScene scene;
  scene.gravity.setZero();
  SoftBody& a = scene.add_soft(kCells, kUnit, Vec3(-0.02, 0.1, 0.05), Vec3(3, 0, 0));
  SoftBody& b = scene.add_soft({3, 2, 2}, Vec3(1.5, 1, 1), Vec3(1, 0, 0), Vec3(-1, 0.2, 0));
  const Vec3 before = a.momentum() + b.momentum();
  double exchanged = 0;
  scene.solve.tolerance = 1e-3;  // unconverged on purpose: what is left over is taken out
  for (int k = 0; k < 60; ++k) {
    scene.step();
    for (const contact::ContactRow& row : scene.islands[0].rows) exchanged += row.impulse().norm();
  }
  EXPECT_GT(exchanged, 1000);
  EXPECT_LT((a.momentum() + b.momentum() - before).norm(), 1e-10 * before.norm());
  EXPECT_LT(a.velocity().x(), b.velocity().x() + 1e-6);  // no longer approaching
  EXPECT_EQ(scene.islands.size(), 2u);                   // and apart
}

// A heavy box dropped on a soft, stiff block on the ground, that leans against another: rows of every kind.
SoftScene leaning(linear_solver::SolverKind solver) {
  SoftScene scene;
  scene.solver = solver;
  scene.solve = {1e-12, 5000};
  scene.passes = 1;  // what a row decides between passes by the sign of almost nothing may differ
  scene.add_plane(Vec3::UnitY(), 0);
  scene.add_soft({6, 4, 4}, Vec3(1.2, 0.8, 0.8), Vec3(0, -0.002, 0), Vec3::Zero(), 1e8);
  scene.add_soft({4, 4, 4}, Vec3(0.8, 0.8, 0.8), Vec3(1.199, 0.01, 0), Vec3(-1, 0, 0), 1e7);
  scene.add_rigid(Vec3(0.5, 0.5, 0.5), Vec3(0.5, 1.06, 0.4), 500, true).v = Vec3(0.3, -2, 0);
  return scene;
}

TEST(CompositeIslands, EverySolverGivesTheSameMotion) {
  SoftScene direct = leaning(linear_solver::SolverKind::direct);
  direct.step();
  ASSERT_GT(direct.rows.size(), 10u);
  EXPECT_EQ(direct.solutions[0].report.iterations, direct.solutions[0].passes);
  for (auto kind : {linear_solver::SolverKind::jacobi, linear_solver::SolverKind::rigid_modes, linear_solver::SolverKind::multigrid, linear_solver::SolverKind::warped_factor}) {
    SoftScene other = leaning(kind);
    other.step();
    for (const IslandSolution& solution : other.solutions) EXPECT_TRUE(solution.report.converged);
    for (std::size_t b = 0; b < direct.soft.size(); ++b)
      for (std::size_t i = 0; i < direct.soft[b].state.v.size(); ++i)
        ASSERT_LT((direct.soft[b].state.v[i] - other.soft[b].state.v[i]).norm(), 1e-6) << static_cast<int>(kind);
    EXPECT_LT((direct.rigid[0].v - other.rigid[0].v).norm(), 1e-6);
  }
}

TEST(CompositeIslands, MultigridNeedsFewerIterationsWhereBodiesAreStiff) {
  int iterations[2];
  for (int k = 0; k < 2; ++k) {
    SoftScene scene = leaning(k == 0 ? linear_solver::SolverKind::jacobi : linear_solver::SolverKind::multigrid);
    scene.solve.tolerance = 1e-3;
    scene.step();
    iterations[k] = scene.solutions[0].report.iterations;
  }
  EXPECT_LT(3 * iterations[1], iterations[0]);
}

TEST(CompositeIslands, InelasticImpactOfSmallOnLargeEndsAtTheCommonVelocity) {
  // F9 with e = 0, m1 = 1000 kg at 1 m/s on m2 = 4000 kg: v = 0.2 m/s while pressed together. Raw damping keeps them so.
  SoftScene scene;
  scene.gravity.setZero();
  scene.settings.raw_damping = true;
  scene.settings.phi = 1e9;
  SoftBody& a = scene.add_soft({1, 1, 1}, kUnit, Vec3(0.001, 0, 0), Vec3(1, 0, 0), 1e9);
  SoftBody& b = scene.add_soft({4, 1, 1}, Vec3(4, 1, 1), Vec3(1, 0, 0), Vec3::Zero(), 1e9);
  scene.run(1);
  EXPECT_NEAR(a.velocity().x(), 0.2, 1e-3);
  EXPECT_NEAR(b.velocity().x(), 0.2, 1e-3);
}

TEST(CompositeIslands, RigidAndSoftExchangeEqualImpulses) {
  SoftScene scene;
  scene.gravity.setZero();
  SoftBody& soft = scene.add_soft(kCells, kUnit, Vec3(0, 0, 0));
  RigidBox& box = scene.add_rigid(Vec3(0.4, 0.4, 0.4), Vec3(0.7, 1.21, 0.6), 300, true);
  box.v = Vec3(0.5, -4, 0);
  scene.solve.tolerance = 1e-8;
  const auto momentum = [&] { return Vec3(soft.momentum() + box.mass * box.v); };
  const auto angular = [&] {
    Vec3 L = box.p.cross(box.mass * box.v) + box.inertia_W() * box.w;
    for (std::size_t i = 0; i < soft.state.x.size(); ++i)
      L += soft.state.x[i].cross(soft.rest.node_mass[i] * soft.state.v[i]);
    return L;
  };
  const Vec3 p0 = momentum(), L0 = angular();
  Vec3 received = Vec3::Zero();
  bool hit = false;
  for (int k = 0; k < 20; ++k) {
    const Vec3 v0 = box.v, w0 = box.w, L_before = angular();
    scene.step();
    for (const IslandSolution& solution : scene.solutions) {
      for (const ContactImpulse& impulse : solution.impulses) received += impulse.impulse_W;
      for (const RigidVelocity& r : solution.rigid) {  // what the solve says and what the impulses do agree
        hit |= (box.v - v0).norm() > 1;
        EXPECT_LT((r.v - box.v).norm(), 1e-6);
        EXPECT_LT((r.w - box.w).norm(), 1e-5 * (1 + w0.norm()));
      }
    }
    if (k == 0) { EXPECT_LT((angular() - L_before).norm(), 0.02 * L_before.norm()); }  // points at x + dt v: first order
  }
  EXPECT_TRUE(hit);
  EXPECT_LT((received - box.mass * (box.v - Vec3(0.5, -4, 0))).norm(), 1e-9 * received.norm());
  EXPECT_LT((momentum() - p0).norm(), 1e-5 * p0.norm());  // tolerance of the solve times 20 steps
  EXPECT_LT((angular() - L0).norm(), 0.1 * L0.norm());
  EXPECT_GT(soft.velocity().y(), -1.5);
  EXPECT_LT(soft.velocity().y(), -0.5);
}

TEST(CompositeIslands, PrescribedNodesKeepTheirVelocityToTheBit) {
  SoftScene scene;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& body = scene.add_soft(kCells, kUnit, Vec3(0, -0.01, 0));
  const Vec3 velocity(0.3, 0.1, -0.7);
  for (int node = 0; node < 9; ++node) body.prescribed.push_back({node, velocity});
  scene.add_soft(kCells, kUnit, Vec3(0, 0.985, 0));
  for (int k = 0; k < 3; ++k) scene.step();
  for (int node = 0; node < 9; ++node) EXPECT_EQ(body.state.v[node], velocity);
  EXPECT_FALSE(scene.islands[0].rows.empty());
}

TEST(CompositeIslands, NonFiniteIslandIsReportedAndOthersGoOnBitForBit) {
  SoftScene scene, reference;
  for (SoftScene* s : {&scene, &reference}) {
    s->add_plane(Vec3::UnitY(), 0);
    s->add_soft(kCells, kUnit, Vec3(0, -0.01, 0));
    s->add_soft(kCells, kUnit, Vec3(5, -0.01, 0));
  }
  RigidBox& box = scene.add_rigid(kUnit, Vec3(0.5, 1.48, 0.5), 100, true);  // on the body that goes bad
  scene.soft[0].state.v[3].x() = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < 5; ++k) {
    scene.step();
    reference.step();
  }
  EXPECT_FALSE(scene.solutions[0].finite);
  EXPECT_TRUE(scene.solutions[0].impulses.empty());
  EXPECT_TRUE(box.v.allFinite());
  for (const contact::FrictionMemory::Entry& entry : scene.memory.entries) EXPECT_TRUE(entry.impulse.allFinite());
  EXPECT_TRUE(scene.solutions[1].finite);
  for (std::size_t i = 0; i < scene.soft[1].state.v.size(); ++i)
    EXPECT_EQ(scene.soft[1].state.v[i], reference.soft[1].state.v[i]);
}

TEST(CompositeIslands, BitsDoNotDependOnThreads) {
  SoftScene one, two;
  two.pool = std::make_unique<ThreadPool>(2);
  for (SoftScene* scene : {&one, &two}) {
    scene->add_plane(Vec3::UnitY(), 0);
    for (int k = 0; k < 6; ++k) {
      const Vec3 at(1.3 * (k % 3) + 0.3 * (k / 3), 0.02 + 1.1 * (k / 3), 0.1 * k);
      scene->add_soft(kCells, kUnit, at, Vec3(0.1 * k, -1, 0));
    }
    scene->add_rigid(Vec3(2, 0.5, 1), Vec3(1.5, 2.6, 0.6), 500, true);
    scene->run(0.5);
  }
  EXPECT_GT(one.rows.size(), 50u);
  for (std::size_t k = 0; k < one.soft.size(); ++k)
    for (std::size_t i = 0; i < one.soft[k].state.x.size(); ++i)
      ASSERT_EQ(one.soft[k].state.x[i], two.soft[k].state.x[i]) << k << ' ' << i;
  EXPECT_EQ(one.rigid[0].p, two.rigid[0].p);
}

}  // namespace
}  // namespace crumple::sim::islands
