#include "server/sim/fem/warped_factor.h"

#include <gtest/gtest.h>

#include "server/sim/fem/bdf2.h"
#include "server/sim/islands/island_preconditioner.h"
#include "tests/sim/islands/soft_scene.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <cstdlib>
#include <numbers>
#include <random>

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;
using linear_solver::SolverKind;

// A beam of 0.1 m cells along x, in space or held at x = 0.
SoftScene beam(std::array<int, 3> cells, double young, bool held) {
  SoftScene scene;
  scene.passes = 1;
  scene.solver = SolverKind::warped_factor;
  scene.solve = {1e-3, 2000};
  SoftBody& body = scene.add_soft(cells, 0.1 * Vec3(cells[0], cells[1], cells[2]), Vec3::Zero(), Vec3(0.3, 0, 0.1), young);
  for (int n = 0; held && n < body.mesh.node_count(); ++n)
    if (body.mesh.X[n].x() < 1e-9) {
      body.prescribed.push_back({n, Vec3::Zero()});
      body.state.v[n].setZero();
    }
  return scene;
}

void turn(SoftBody& body, const Mat3& R) {
  for (Vec3& x : body.state.x) x = R * x;
  for (Vec3& v : body.state.v) v = R * v;
  for (fem::PrescribedNode& p : body.prescribed) p.velocity = R * p.velocity;
}

// Along x on a circle that is as long as the beam times this many turns.
void bend(SoftBody& body, double turns) {
  double length = 0;
  for (const Vec3& X : body.mesh.X) length = std::max(length, X.x());
  const double k = 2 * std::numbers::pi * turns / length;
  for (std::size_t i = 0; i < body.mesh.X.size(); ++i) {
    const Vec3& X = body.mesh.X[i];
    body.state.x[i] = Vec3(std::sin(k * X.x()) * (1 / k - X.y()), (1 - std::cos(k * X.x())) / k + X.y() * std::cos(k * X.x()), X.z());
  }
}

const Mat3 kTurned = Eigen::AngleAxisd(2.5, Vec3(1, 2, -1).normalized()).toRotationMatrix();

int iterations(SoftScene& scene) {
  scene.step();
  EXPECT_TRUE(scene.solutions[0].report.converged);
  return scene.solutions[0].report.iterations;
}

TEST(WarpedFactor, IsTheWholeInverseWhereABodyHasOnlyTurned) {
  for (const double young : {1e6, 1e9}) {
    SoftScene scene = beam({6, 2, 2}, young, true);
    turn(scene.soft[0], kTurned);
    const auto bodies = scene.assemble();
    fem::WarpedFactor& factor = scene.soft[0].factor;
    ASSERT_TRUE(factor.update(scene.soft[0].rest, scene.soft[0].mesh.X, scene.soft[0].system, *scene.pool));
    for (const Mat3& R : factor.rotations()) EXPECT_LT((R - kTurned).norm(), 1e-12);
    std::srand(1);
    const VectorXd x = VectorXd::Random(3 * scene.soft[0].mesh.node_count());
    VectorXd Ax(x.size()), z(x.size());
    scene.soft[0].system.multiply(x, Ax, *scene.pool);
    factor.apply(Ax, z, *scene.pool);
    EXPECT_LT((z - x).norm(), 3e-3 * x.norm()) << young;  // L in single precision times a condition of up to 1e5
  }
}

TEST(WarpedFactor, IsSymmetricAndPositiveDefiniteForAnyPositionsOfTheNodes) {
  SoftScene scene = beam({2, 2, 2}, 1e7, false);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (Vec3& x : scene.soft[0].state.x) x = Vec3(anywhere(random), anywhere(random), anywhere(random));  // half of the tets are inverted
  const auto bodies = scene.assemble();
  ASSERT_GT(fem::inverted_count(scene.soft[0].mesh.tets, scene.soft[0].state.x, *scene.pool), 10);
  fem::WarpedFactor& factor = scene.soft[0].factor;
  ASSERT_TRUE(factor.update(scene.soft[0].rest, scene.soft[0].mesh.X, scene.soft[0].system, *scene.pool));
  const int n = 3 * scene.soft[0].mesh.node_count();
  Eigen::MatrixXd M(n, n);
  VectorXd z(n);
  for (int k = 0; k < n; ++k) {
    factor.apply(VectorXd::Unit(n, k), z, *scene.pool);
    M.col(k) = z;
  }
  EXPECT_LT((M - M.transpose()).norm(), 1e-12 * M.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(M).eigenvalues().minCoeff(), 0);
}

TEST(WarpedFactor, SolvesAsTheDirectSolverDoes) {
  for (const double young : {1e6, 1e8}) {
    SoftScene direct = beam({8, 2, 2}, young, true), warped = beam({8, 2, 2}, young, true);
    direct.solver = SolverKind::direct;
    warped.solve.tolerance = 1e-9;
    for (SoftScene* scene : {&direct, &warped}) {
      bend(scene->soft[0], 0.15);
      scene->step();
    }
    ASSERT_EQ(warped.solutions[0].solver, SolverKind::warped_factor);
    EXPECT_LT((direct.solutions[0].velocity - warped.solutions[0].velocity).norm(), 1e-6 * direct.solutions[0].velocity.norm()) << young;
  }
}

TEST(WarpedFactor, TakesOneIterationHoweverABodyTurned) {
  for (const double young : {1e6, 1e7, 1e8, 1e9})
    for (const bool held : {true, false}) {
      SoftScene scene = beam({12, 3, 3}, young, held);
      turn(scene.soft[0], kTurned);
      EXPECT_LE(iterations(scene), 2) << young << held;
    }
}

TEST(WarpedFactor, TakesATenthOfTheIterationsOfABentBeamThatIsHeld) {
  for (const double young : {1e6, 1e7, 1e8, 1e9}) {
    SoftScene warped = beam({12, 3, 3}, young, true), paper = beam({12, 3, 3}, young, true);
    bend(warped.soft[0], 0.25);
    bend(paper.soft[0], 0.25);
    paper.solver = SolverKind::jacobi;
    const int few = iterations(warped), many = iterations(paper);
    EXPECT_LE(few, 16) << young;
    EXPECT_LT((young < 5e6 ? 5 : 10) * few, many) << young;
  }
}

// Held by the layer in its middle: the matrix falls into two parts.
TEST(WarpedFactor, SolvesABeamThatIsHeldInItsMiddle) {
  SoftScene scene = beam({16, 4, 4}, 1e7, false);
  SoftBody& body = scene.soft[0];
  for (int n = 0; n < body.mesh.node_count(); ++n)
    if (std::abs(body.mesh.X[n].x() - 0.8) < 1e-6) body.prescribed.push_back({n, body.state.v[n] = Vec3::Zero()});
  ASSERT_EQ(body.prescribed.size(), 25u);
  EXPECT_LE(iterations(scene), 2);
}

// Rotations of nodes are those of their elements whichever way the body is turned.
TEST(WarpedFactor, ABentBeamTakesAsManyIterationsHoweverItIsTurned) {
  int fewest = 1000, most = 0;
  for (const double angle : {0.0, 0.5, 1.57, 2.06, 3.1}) {
    SoftScene scene = beam({12, 3, 3}, 1e7, true);
    bend(scene.soft[0], 0.25);
    turn(scene.soft[0], Eigen::AngleAxisd(angle, Vec3(1, 2, -1).normalized()).toRotationMatrix());
    const int taken = iterations(scene);
    fewest = std::min(fewest, taken);
    most = std::max(most, taken);
  }
  EXPECT_LE(most, fewest + 2);
}

// What is bent by a quarter of a circle is not a rotation anywhere, and nothing holds it: the stiffer, the more of that is left.
TEST(WarpedFactor, BentInSpaceTakesTensOfIterationsWhereItIsVeryStiff) {
  for (const double young : {1e7, 1e9}) {
    SoftScene scene = beam({12, 3, 3}, young, false);
    bend(scene.soft[0], 0.25);
    EXPECT_LE(iterations(scene), 40) << young;  // 14 and 34
  }
}

TEST(WarpedFactor, IsWhatAutomaticIsForSmallStiffBodiesThatNothingTouches) {
  const auto chosen = [](std::array<int, 3> cells, double young, bool touched, bool whole) {
    SoftScene scene = beam(cells, young, false);
    if (touched) scene.add_plane(Vec3(0, 1, 0), 0.01);
    std::vector<IslandBody> bodies = scene.assemble();
    if (!whole) bodies[0].factor = nullptr;
    scene.detect();
    const CompositeIsland island = composite_islands(bodies, scene.rows).at(0);
    return IslandSystem(island, bodies).choose(SolverKind::automatic);
  };
  EXPECT_EQ(chosen({4, 4, 4}, 1e7, false, true), SolverKind::warped_factor);
  EXPECT_EQ(chosen({4, 4, 4}, 1e7, true, true), SolverKind::rigid_modes);
  EXPECT_EQ(chosen({4, 4, 4}, 1e7, false, false), SolverKind::rigid_modes);
  EXPECT_EQ(chosen({4, 4, 4}, 1e2, false, true), SolverKind::jacobi);
  EXPECT_EQ(chosen({16, 6, 6}, 1e7, false, true), SolverKind::multigrid);
}

TEST(WarpedFactor, IsWhatAutomaticIsForLargerHeldOnesIfItWasMadeBefore) {
  struct Case {
    std::array<int, 3> cells;
    double young;
    bool held, breakable, worth;
  };
  for (const Case& c : {Case{{16, 4, 4}, 1e7, true, false, true}, Case{{16, 4, 4}, 1e7, false, false, false},
                        Case{{16, 4, 4}, 1e7, true, true, false}, Case{{16, 4, 4}, 1e2, true, false, false},
                        Case{{16, 8, 8}, 1e7, true, false, false}}) {
    SoftScene scene = beam(c.cells, c.young, c.held);
    SoftBody& body = scene.soft[0];
    body.rest.material.breakable = c.breakable;
    const std::vector<IslandBody> bodies = scene.assemble();
    const CompositeIsland island = composite_islands(bodies, scene.rows).at(0);
    const auto chosen = [&] { return IslandSystem(island, bodies).choose(SolverKind::automatic); };
    EXPECT_EQ(is_worth_a_factor(bodies[0]), c.worth) << body.mesh.node_count();
    if (!c.worth) continue;
    EXPECT_EQ(chosen(), SolverKind::multigrid);
    body.factor.make(body.rest, body.mesh.X, body.system, fem::bdf2_scale(scene.dt), *scene.pool);
    EXPECT_EQ(chosen(), SolverKind::multigrid);
    body.factor.make(body.rest, body.mesh.X, body.system, body.system.scale, *scene.pool);
    EXPECT_EQ(chosen(), SolverKind::warped_factor);
    EXPECT_EQ(body.factor.factored(), 2);
  }
}

TEST(WarpedFactor, IsMadeOnceForEachFormulaAndKept) {
  SoftScene scene = beam({4, 2, 2}, 1e7, true);
  fem::WarpedFactor& factor = scene.soft[0].factor;
  for (int k = 0; k < 3; ++k) scene.step();
  EXPECT_EQ(factor.factored(), 1);
  scene.dt /= 4;
  scene.step();
  EXPECT_EQ(factor.factored(), 2);
  scene.dt *= 4;
  scene.step();
  EXPECT_EQ(factor.factored(), 2);
  scene.soft[0].prescribed.pop_back();
  scene.step();
  EXPECT_EQ(factor.factored(), 3);
}

TEST(WarpedFactor, GivesTheSameBitsForAnyThreadsAndWhateverWasKeptBefore) {
  SoftScene one = beam({14, 4, 4}, 1e7, true), two = beam({14, 4, 4}, 1e7, true);
  two.pool = std::make_unique<ThreadPool>(2);
  two.dt = 1.0 / 240;
  two.assemble();
  ASSERT_TRUE(two.soft[0].factor.update(two.soft[0].rest, two.soft[0].mesh.X, two.soft[0].system, *two.pool));  // not this step's
  two.dt = 1.0 / 60;
  for (SoftScene* scene : {&one, &two}) {
    bend(scene->soft[0], 0.1);
    for (int k = 0; k < 3; ++k) scene->step();
  }
  EXPECT_EQ(one.soft[0].state.x, two.soft[0].state.x);
  EXPECT_EQ(one.soft[0].state.v, two.soft[0].state.v);
}

TEST(WarpedFactor, SolvesElementsOfSeveralTetsToo) {
  for (const auto element : {fem::ElementKind::smoothed_octahedra, fem::ElementKind::hexahedra}) {
    SoftScene direct = beam({8, 2, 2}, 1e7, true), warped = beam({8, 2, 2}, 1e7, true);
    direct.solver = SolverKind::direct;
    warped.solve.tolerance = 1e-9;
    for (SoftScene* scene : {&direct, &warped}) {
      SoftBody& body = scene->soft[0];
      body.rest = fem::make_rest_body(body.mesh, body.rest.material, 0, {}, element).value();
      body.state.plastic_strain.assign(body.rest.point_count(), Mat3::Zero());
      bend(body, 0.1);
      body.state.x.back() = body.state.x.front();  // tets that stand for themselves
      scene->step();
    }
    ASSERT_EQ(warped.solutions[0].solver, SolverKind::warped_factor);
    EXPECT_LT((direct.solutions[0].velocity - warped.solutions[0].velocity).norm(), 1e-6 * direct.solutions[0].velocity.norm());
  }
}

// A stiff block between a plane, a rigid box and another block.
TEST(WarpedFactor, SolvesContactAsTheDirectSolverDoes) {
  const auto make = [](SolverKind solver) {
    SoftScene scene;
    scene.passes = 1;
    scene.solver = solver;
    scene.solve = {1e-10, 5000};
    scene.add_soft({3, 2, 2}, Vec3(0.3, 0.2, 0.2), Vec3(0, -0.001, 0), Vec3(0, -0.5, 0), 1e8);
    scene.add_soft({2, 2, 2}, Vec3(0.2, 0.2, 0.2), Vec3(0.05, 0.198, 0), Vec3(0, -1, 0), 1e7);
    scene.add_rigid(Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.447, 0.1), 30, true).v = Vec3(0, -1.5, 0.2);
    scene.add_plane(Vec3(0, 1, 0), 0);
    scene.step();
    return scene;
  };
  SoftScene direct = make(SolverKind::direct), warped = make(SolverKind::warped_factor);
  ASSERT_EQ(warped.solutions.size(), 1u);
  ASSERT_GT(warped.rows.size(), 10u);
  EXPECT_TRUE(warped.solutions[0].report.converged);
  EXPECT_LT((direct.solutions[0].velocity - warped.solutions[0].velocity).norm(), 1e-6 * direct.solutions[0].velocity.norm());
}

TEST(WarpedFactor, WithRowsIsStillSymmetricAndPositiveDefinite) {
  SoftScene scene;
  scene.add_soft({2, 1, 1}, Vec3(0.2, 0.1, 0.1), Vec3(0, -0.002, 0), Vec3(0, -1, 0), 1e7);
  scene.add_rigid(Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.147, 0.05), 30, true);
  scene.add_plane(Vec3(0, 1, 0), 0);
  const std::vector<IslandBody> bodies = scene.assemble();
  scene.detect();
  CompositeIsland island = composite_islands(bodies, scene.rows).at(0);
  ASSERT_GT(island.rows.size(), 4u);
  for (contact::ContactRow& row : island.rows) row.c_n *= 1e3, row.c_t = 0.3 * row.c_n;
  const IslandSystem system(island, bodies);
  contact::ContactRows rows(island.rows, system.first_block(), system.blocks());
  rows.refresh(ThreadPool(1));
  IslandPreconditioner preconditioner(system, SolverKind::warped_factor, *scene.pool);
  ASSERT_EQ(preconditioner.kind(), SolverKind::warped_factor);
  preconditioner.refresh(rows);
  const int n = 3 * system.blocks();
  Eigen::MatrixXd M(n, n);
  VectorXd z(n);
  for (int k = 0; k < n; ++k) {
    preconditioner.apply(VectorXd::Unit(n, k), z);
    M.col(k) = z;
  }
  EXPECT_LT((M - M.transpose()).norm(), 1e-10 * M.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (M + M.transpose())).eigenvalues().minCoeff(), 0);
}

TEST(WarpedFactor, LeavesABodyThatBrokeToWhatAutomaticIs) {
  SoftScene scene = beam({4, 2, 2}, 1e7, true);
  std::vector<IslandBody> bodies = scene.assemble();
  CompositeIsland island{.soft = {0}};
  const IslandOptions options{.solver = SolverKind::warped_factor};
  EXPECT_EQ(solve(island, bodies, options, {}, *scene.pool).solver, SolverKind::warped_factor);
  bodies[0].factor = nullptr;
  EXPECT_EQ(solve(island, bodies, options, {}, *scene.pool).solver, IslandSystem(island, bodies).choose_without_factors());
}

TEST(WarpedFactor, WithoutAFactorTheSolveIsWhatAutomaticIs) {
  SoftScene scene = beam({4, 2, 2}, 1e7, false);
  SoftBody& body = scene.soft[0];
  const std::vector<IslandBody> bodies = scene.assemble();
  for (double& m : body.rest.node_mass) m = -m;  // no longer positive definite, nor a body
  CompositeIsland island{.soft = {0}};
  const auto solution = solve(island, bodies, {.solver = SolverKind::warped_factor}, {}, *scene.pool);
  EXPECT_EQ(solution.solver, IslandSystem(island, bodies).choose_without_factors());
  EXPECT_TRUE(solution.finite && solution.report.converged);
}

// Inside out and back: the preconditioner must not keep a body from coming home.
TEST(WarpedFactor, AMirroredBodyComesBackAsWithTheDirectSolver) {
  double energy[2];
  int inverted[2];
  for (int k = 0; k < 2; ++k) {
    SoftScene scene = beam({3, 2, 2}, 1e6, false);
    scene.gravity.setZero();
    if (k == 1) scene.solver = SolverKind::direct;
    SoftBody& body = scene.soft[0];
    for (Vec3& x : body.state.x) x.z() *= -1;
    for (Vec3& v : body.state.v) v.setZero();
    ASSERT_EQ(fem::inverted_count(body.mesh.tets, body.state.x, ThreadPool(1)), body.mesh.tet_count());
    scene.run(3);
    energy[k] = fem::elastic_energy(body.rest, body.mesh.tets, body.state.x, body.state.plastic_strain);
    inverted[k] = fem::inverted_count(body.mesh.tets, body.state.x, ThreadPool(1));
  }
  EXPECT_EQ(inverted[0], inverted[1]);
  EXPECT_NEAR(energy[0], energy[1], 0.05 * energy[1]);  // of 4 J; the tolerance of 1e-3 in 180 steps
}

TEST(WarpedFactor, AStiffBarThatSpinsKeepsItsMomentumAndItsShape) {
  SoftScene scene = beam({8, 1, 1}, 1e8, false);
  scene.gravity.setZero();
  SoftBody& body = scene.soft[0];
  const Vec3 centre = body.centre();
  for (std::size_t i = 0; i < body.state.v.size(); ++i) body.state.v[i] = Vec3(0, 0, 6).cross(body.state.x[i] - centre);
  const Vec3 before = body.momentum();
  scene.run(2);
  EXPECT_LT((body.momentum() - before).norm(), 1e-9 * body.mass());
  EXPECT_EQ(fem::inverted_count(body.mesh.tets, body.state.x, ThreadPool(1)), 0);
  double longest = 0;
  for (const Vec3& x : body.state.x) longest = std::max(longest, (x - body.centre()).norm());
  EXPECT_NEAR(longest, 0.4, 0.02);
}

}  // namespace
}  // namespace crumple::sim::islands
