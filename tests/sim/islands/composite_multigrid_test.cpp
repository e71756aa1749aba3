#include "server/sim/islands/composite_multigrid.h"

#include "server/sim/linear_solver/conjugate_gradient.h"
#include "tests/support/kuhn_lattice.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <random>

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;
using linear_solver::BlockSparseMatrix;
using linear_solver::MultigridHierarchy;

const ThreadPool kOne(1), kTwo(2);

struct Body {
  TetMesh mesh;
  fem::RestBody rest;
  fem::FemState state;
  fem::StepSystem system;
  MultigridHierarchy hierarchy;
  std::vector<int> held;

  // Deformed: bent about z, a little shaken, falling.
  void assemble(double young, double dt, double poisson = 0.3, fem::ElementKind element = fem::ElementKind::linear_tetrahedra) {
    fem::FemMaterial material;
    material.young = young;
    material.poisson = poisson;
    rest = *fem::make_rest_body(mesh, material, 0, {}, element);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> shake(-0.01, 0.01);
    state = {mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3(0.1, -1, 0.2)), std::vector<Mat3>(rest.point_count(), Mat3::Zero())};
    for (Vec3& x : state.x) x += Vec3(0.1 * x.y() * x.x(), -0.2 * x.x() * x.x(), 0) + Vec3(shake(random), shake(random), shake(random)) * 0.1;
    std::vector<fem::PrescribedNode> prescribed;
    for (int n : held) prescribed.push_back({n, Vec3::Zero()});
    VectorXd f(3 * mesh.node_count());
    for (int n = 0; n < mesh.node_count(); ++n) f.segment<3>(3 * n) = rest.node_mass[n] * Vec3(0, -9.81, 0);
    fem::assemble(rest, mesh.tets, state, f, dt, prescribed, kOne, system);
  }

  double mean_volume() const {
    double sum = 0;
    for (double v : rest.volume) sum += v;
    return sum / rest.tet_count();
  }

  void update() {
    std::visit([&](const auto& A) { hierarchy.update(A, mesh.X, system.prescribed, mean_volume(), kOne); }, system.A);
  }
};

Body beam(std::array<int, 3> cells, double H) {
  Body body;
  body.mesh = test::kuhn_lattice(cells, H);
  for (int n = 0; n < body.mesh.node_count(); ++n)
    if (body.mesh.X[n].x() < 1e-9) body.held.push_back(n);
  return body;
}

// Parts the mesh along the faces between tets on the two sides of the plane x = at, for y below `depth`.
void crack(TetMesh& mesh, double at, double depth) {
  std::map<int, int> copy;
  const int first_new = mesh.node_count();
  std::vector<Vec3> X = mesh.X;
  for (Tet& tet : mesh.tets) {
    Vec3 centre = Vec3::Zero();
    for (int n : tet) centre += mesh.X[n] / 4;
    if (centre.x() < at) continue;
    for (int& n : tet) {
      if (n >= first_new || std::abs(mesh.X[n].x() - at) > 1e-9 || mesh.X[n].y() > depth + 1e-9) continue;
      const auto [entry, added] = copy.try_emplace(n, static_cast<int>(X.size()));
      if (added) X.push_back(mesh.X[n]);
      n = entry->second;
    }
  }
  mesh.X = X;
}

double largest_eigenvalue(const BlockSparseMatrix<float>& A) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  VectorXd x = VectorXd::NullaryExpr(3 * A.rows(), [&] { return normal(random); }), y(x.size());
  double value = 0;
  for (int k = 0; k < 60; ++k) {
    A.multiply(x, y, kOne);
    for (int i = 0; i < A.rows(); ++i) y.segment<3>(3 * i) = (A.diagonal()[i].inverse() * y.segment<3>(3 * i)).eval();
    value = y.norm() / x.norm();
    x = y / y.norm();
  }
  return value;
}

linear_solver::SolveReport solve(Body& body, VectorXd& v, double tolerance, const ThreadPool& pool) {
  contact::ContactRows none;
  const MultigridPart part{&body.system, &body.hierarchy, 0};
  CompositeMultigrid multigrid(std::span(&part, 1), {}, none, pool);
  linear_solver::CgWorkspace workspace;
  v = body.system.guess;
  return linear_solver::conjugate_gradient([&](const auto& in, auto& out) { body.system.multiply(in, out, pool); },
                                           [&](const auto& in, auto& out) { multigrid.apply(in, out); }, body.system.b, v,
                                           {tolerance, 200}, workspace, pool);
}

// M^-1 column by column.
Eigen::MatrixXd dense(CompositeMultigrid& multigrid, Eigen::Index size) {
  Eigen::MatrixXd M(size, size);
  VectorXd e(size), z(size);
  for (Eigen::Index k = 0; k < size; ++k) {
    e = VectorXd::Unit(size, k);
    multigrid.apply(e, z);
    M.col(k) = z;
  }
  return M;
}

// Rows between two soft bodies, and between the first and a rigid body, at random tets.
std::vector<contact::ContactRow> random_rows(const Body& a, const Body& b, double coefficient) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<contact::ContactRow> rows;
  const auto soft = [&](const Body& body, int index, double sign) {
    contact::ContactSide side{.body = index, .tet = static_cast<int>(unit(random) * body.mesh.tet_count())};
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const int n = body.mesh.tets[side.tet][k];
      const double w = unit(random);
      sum += w;
      if (body.system.prescribed[n]) continue;
      side.nodes[side.node_count] = n;
      side.weights[side.node_count++] = sign * w;
    }
    for (int k = 0; k < side.node_count; ++k) side.weights[k] /= sum;
    return side;
  };
  for (int k = 0; k < 40; ++k) {
    contact::ContactRow row;
    row.sides[0] = soft(a, 0, 1);
    if (k % 2 == 0) row.sides[1] = soft(b, 1, -1);
    else row.sides[1] = {.body = 2, .rigid = true, .arm = Vec3(unit(random), unit(random), unit(random))};
    row.normal = Vec3(unit(random) - 0.5, unit(random), unit(random)).normalized();
    row.c_n = coefficient * unit(random);
    row.c_t = row.c_n * unit(random);
    rows.push_back(row);
  }
  return rows;
}

TEST(CompositeMultigrid, IsSymmetricAndPositiveDefiniteWithContactAndRigidBodies) {
  for (const double coefficient : {1.0, 1e3, 1e6}) {
    Body a = beam({8, 3, 3}, 0.1), b = beam({6, 3, 3}, 0.1);
    crack(a.mesh, 0.4, 0.2);
    a.assemble(1e7, 1.0 / 60);
    b.assemble(1e6, 1.0 / 60);
    a.update();
    b.update();
    auto rows = random_rows(a, b, coefficient);
    const int blocks_a = a.system.node_count(), blocks_b = b.system.node_count(), blocks = blocks_a + blocks_b + 2;
    const std::vector<int> first_block{0, blocks_a, blocks_a + blocks_b};
    const contact::ContactRows contact(rows, first_block, blocks);
    const MultigridPart parts[] = {{&a.system, &a.hierarchy, 0}, {&b.system, &b.hierarchy, blocks_a}};
    const Mat3 rigid[] = {20 * Mat3::Identity(), Vec3(0.13, 0.2, 0.1).asDiagonal()};
    CompositeMultigrid multigrid(parts, rigid, contact, kOne);
    ASSERT_GE(multigrid.level_count(), 2);
    const Eigen::MatrixXd M = dense(multigrid, 3 * blocks);
    EXPECT_LT((M - M.transpose()).norm() / M.norm(), 1e-4) << coefficient;  // single precision
    const VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (M + M.transpose())).eigenvalues();
    EXPECT_GT(values.minCoeff(), 0) << coefficient;
  }
}

// What smoothing counts on (composite_multigrid.cpp).
TEST(CompositeMultigrid, NoEigenvalueIsAboveFourTimesTheDiagonal) {
  for (int kind = 0; kind < 3; ++kind) {
    Body body = kind == 0 ? beam({25, 4, 4}, 0.08) : beam({20, 20, 1}, 0.1);
    for (double at : {0.4, 1.0, 1.7})
      if (kind == 2) crack(body.mesh, at, 1.5);
    body.assemble(1e7, 1.0 / 60, kind == 1 ? 0.45 : 0.3);
    body.update();
    for (const auto& level : body.hierarchy.levels()) EXPECT_LT(largest_eigenvalue(level.A), 4) << kind;
  }
}

// Of octahedra with pressure patches, whose bound is what the largest patch has of nodes.
TEST(CompositeMultigrid, NoEigenvalueIsAboveTheBoundOfPatches) {
  for (const double poisson : {0.45, 0.4999}) {
    Body body = beam({25, 4, 4}, 0.08);
    body.assemble(1e7, 1.0 / 60, poisson, fem::ElementKind::smoothed_octahedra);
    body.update();
    EXPECT_EQ(body.system.spectral_bound, 8);
    EXPECT_GE(body.hierarchy.levels().size(), 2u);
    for (const auto& level : body.hierarchy.levels()) EXPECT_LT(largest_eigenvalue(level.A), 0.9 * body.system.spectral_bound) << poisson;
    VectorXd v;
    const auto report = solve(body, v, 1e-6, kOne);
    EXPECT_TRUE(report.converged) << poisson;
  }
}

// Of hexahedra the finest bound is that of a cell by itself.
TEST(CompositeMultigrid, NoEigenvalueIsAboveTheBoundOfHexahedraAndFineMeshesNeedAsManyIterations) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    std::vector<int> iterations;
    for (const int n : {2, 4, 8}) {
      Body body = beam({6 * n, n, n}, 0.16 / n);
      body.assemble(1e6, 1.0 / 60, poisson, fem::ElementKind::hexahedra);
      body.update();
      EXPECT_GE(body.system.spectral_bound, poisson > 0.4 ? 4.5 : 4);
      EXPECT_LE(body.system.spectral_bound, 8);
      for (const auto& level : body.hierarchy.levels()) EXPECT_LT(largest_eigenvalue(level.A), 0.92 * body.system.spectral_bound) << poisson;
      VectorXd v;
      const auto report = solve(body, v, 1e-6, kOne);
      EXPECT_TRUE(report.converged) << poisson;
      iterations.push_back(report.iterations);
    }
    EXPECT_LE(iterations[2], 1.3 * iterations[1]) << poisson;
  }
}

TEST(CompositeMultigrid, NeedsAsManyIterationsOnAFineMeshAsOnACoarseOne) {
  std::vector<int> iterations;
  for (int n : {2, 4, 8}) {
    Body body = beam({6 * n, n, n}, 0.16 / n);
    body.assemble(1e6, 1.0 / 60);
    body.update();
    VectorXd v;
    const auto report = solve(body, v, 1e-6, kOne);
    EXPECT_TRUE(report.converged);
    iterations.push_back(report.iterations);
  }
  EXPECT_LE(iterations.back(), iterations.front() + 8);
  EXPECT_LE(iterations.back(), 30);
}

TEST(CompositeMultigrid, ACrackOfNoWidthCostsAFewIterations) {
  Body whole = beam({24, 8, 4}, 0.05), cracked = beam({24, 8, 4}, 0.05);
  crack(cracked.mesh, 0.6, 0.3);
  int iterations[2];
  for (int k = 0; k < 2; ++k) {
    Body& body = k == 0 ? whole : cracked;
    body.assemble(1e7, 1.0 / 60);
    body.update();
    VectorXd v;
    iterations[k] = solve(body, v, 1e-6, kOne).iterations;
  }
  EXPECT_LE(iterations[1], 1.75 * iterations[0]);  // 21 and 33; block-Jacobi needs hundreds for either
}

TEST(CompositeMultigrid, GivesTheSameBitsWithTwoThreads) {
  Body body = beam({40, 10, 10}, 0.05);
  body.assemble(1e7, 1.0 / 60);
  body.update();
  VectorXd one, two;
  solve(body, one, 1e-4, kOne);
  solve(body, two, 1e-4, kTwo);
  EXPECT_EQ((one - two).norm(), 0);
}

}  // namespace
}  // namespace crumple::sim::islands
