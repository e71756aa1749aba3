#include "server/sim/linear_solver/level_transfer.h"

#include "server/sim/linear_solver/galerkin_product.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"
#include "tests/support/kuhn_lattice.h"
#include "tests/sim/linear_solver/tet_edges.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <random>

namespace crumple::sim::linear_solver {
namespace {

const ThreadPool kOne(1), kTwo(2);

BlockSparseMatrix<double> random_matrix(const TetMesh& mesh) {
  auto A = BlockSparseMatrix<double>::from_edges(mesh.node_count(), edges_of(mesh.tets));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < A.rows(); ++i) {
    A.diagonal()[i] = 40 * Mat3::Identity();
    for (int k = A.row_start()[i]; k < A.row_start()[i + 1]; ++k) {
      const int j = A.columns()[k];
      if (j < i) continue;
      const Mat3 B = Mat3::NullaryExpr([&] { return unit(random); });
      A.set_block(k, B);
      A.set_block(A.find(j, i), B.transpose());
    }
  }
  return A;
}

LevelTransfer transfer_of(const TetMesh& mesh, const BlockSparseMatrix<double>& A, const CoarseLattice& lattice,
                          std::vector<Vec3>& coarse_X, std::vector<char> held = {}) {
  held.resize(mesh.node_count(), 0);
  return make_transfer(mesh.X, {A.row_start(), A.columns()}, held, lattice, true, coarse_X);
}

Vec3 affine(const Vec3& X) { return Vec3(1, -2, 0.5) + Vec3(X.y() - 0.3 * X.z(), 2 * X.x(), X.x() + X.y() + X.z()); }

// The largest distance between what coarse values of an affine motion give at the fine points and that motion, at points
// further than `rim` from the box [0, high].
double affine_error(const TetMesh& mesh, const LevelTransfer& t, const std::vector<Vec3>& coarse_X, const Vec3& high, double rim) {
  double worst = 0;
  for (int i = 0; i < t.fine_count(); ++i) {
    if (mesh.X[i].minCoeff() < rim - 1e-9 || (high - mesh.X[i]).minCoeff() < rim - 1e-9) continue;
    Vec3 u = Vec3::Zero();
    for (int k = t.row_start[i]; k < t.row_start[i + 1]; ++k) u += double(t.weight[k]) * affine(coarse_X[t.coarse[k]]);
    worst = std::max(worst, (u - affine(mesh.X[i])).norm());
  }
  return worst;
}

TEST(CoarseLattice, TakesEverySecondPlaneOfAKuhnLattice) {
  TetMesh mesh = test::kuhn_lattice({6, 4, 5}, 0.1);
  const CoarseLattice lattice = coarse_lattice(mesh.X, 1e-3 / 6);
  EXPECT_LT((lattice.spacing - Vec3::Constant(0.2)).norm(), 1e-9);
  EXPECT_LT(lattice.origin.norm(), 1e-12);
}

TEST(CoarseLattice, IsAsWideAsTheTetsOfAMeshWithoutPlanes) {
  TetMesh mesh = test::kuhn_lattice({4, 4, 4}, 0.1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> shake(-0.02, 0.02);
  for (Vec3& X : mesh.X) X += Vec3(shake(random), shake(random), shake(random));
  EXPECT_LT((coarse_lattice(mesh.X, 1e-3 / 6).spacing - Vec3::Constant(0.2)).norm(), 1e-9);
}

TEST(LevelTransfer, ReproducesAffineMotionOnAlignedAndOnAnyMesh) {
  TetMesh mesh = test::kuhn_lattice({8, 4, 4}, 0.1);
  const auto A = random_matrix(mesh);
  std::vector<Vec3> coarse_X;
  const LevelTransfer aligned = transfer_of(mesh, A, {Vec3::Zero(), Vec3::Constant(0.2)}, coarse_X);
  EXPECT_EQ(aligned.coarse_count(), 5 * 3 * 3);
  const Vec3 high(0.8, 0.4, 0.4);
  EXPECT_LT(affine_error(mesh, aligned, coarse_X, high, 0), 1e-6);  // weights are floats
  for (int i = 0; i < aligned.fine_count(); ++i) EXPECT_LE(aligned.row_start[i + 1] - aligned.row_start[i], 2);
  const LevelTransfer shifted = transfer_of(mesh, A, {Vec3(-0.033, -0.071, -0.05), Vec3::Constant(0.19)}, coarse_X);
  EXPECT_LT(affine_error(mesh, shifted, coarse_X, high, 0.1), 1e-6);  // at the rim lattice points that hardly count are left out
}

TEST(LevelTransfer, RowsAndColumnsAreTheSameMatrix) {
  TetMesh mesh = test::kuhn_lattice({5, 3, 3}, 0.1);
  std::vector<Vec3> coarse_X;
  const LevelTransfer t = transfer_of(mesh, random_matrix(mesh), {Vec3(0.01, 0, 0), Vec3::Constant(0.21)}, coarse_X);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(t.fine_count(), t.coarse_count()), columns = rows;
  for (int i = 0; i < t.fine_count(); ++i)
    for (int k = t.row_start[i]; k < t.row_start[i + 1]; ++k) rows(i, t.coarse[k]) += t.weight[k];
  for (int I = 0; I < t.coarse_count(); ++I)
    for (int k = t.column_start[I]; k < t.column_start[I + 1]; ++k) columns(t.fine[k], I) += t.column_weight[k];
  EXPECT_EQ((rows - columns).norm(), 0);
  EXPECT_LT((rows.rowwise().sum() - Eigen::VectorXd::Ones(t.fine_count())).norm(), 1e-5);
}

TEST(LevelTransfer, HeldNodesTakeNoWeights) {
  TetMesh mesh = test::kuhn_lattice({4, 2, 2}, 0.1);
  std::vector<char> held(mesh.node_count(), 0);
  for (int n = 0; n < mesh.node_count(); ++n) held[n] = mesh.X[n].x() < 0.25;
  std::vector<Vec3> coarse_X;
  const LevelTransfer t = transfer_of(mesh, random_matrix(mesh), {Vec3::Zero(), Vec3::Constant(0.2)}, coarse_X, held);
  for (int n = 0; n < mesh.node_count(); ++n) EXPECT_EQ(t.row_start[n + 1] == t.row_start[n], held[n] != 0) << n;
  for (int I = 0; I < t.coarse_count(); ++I) EXPECT_GT(t.column_start[I + 1], t.column_start[I]);
}

// Two blocks on one place in space, not connected: as a crack of no width leaves them.
TEST(LevelTransfer, WhatIsPartedIsNotMovedTogether) {
  TetMesh mesh = test::kuhn_lattice({4, 4, 2}, 0.1);
  const int half = mesh.node_count();
  const TetMesh one = mesh;
  for (const Vec3& X : one.X) mesh.X.push_back(X);
  for (const Tet& tet : one.tets) mesh.tets.push_back({tet[0] + half, tet[1] + half, tet[2] + half, tet[3] + half});
  std::vector<Vec3> coarse_X;
  const LevelTransfer t = transfer_of(mesh, random_matrix(mesh), {Vec3::Zero(), Vec3::Constant(0.2)}, coarse_X);
  EXPECT_EQ(t.coarse_count(), 2 * 3 * 3 * 2);
  for (int I = 0; I < t.coarse_count(); ++I) {
    const bool second = t.fine[t.column_start[I]] >= half;
    for (int k = t.column_start[I]; k < t.column_start[I + 1]; ++k) EXPECT_EQ(t.fine[k] >= half, second);
  }
}

TEST(LevelTransfer, ATinyPieceMovesAsOne) {
  TetMesh mesh;
  mesh.X = {Vec3(0.03, 0.04, 0.05), Vec3(0.11, 0.02, 0.03), Vec3(0.02, 0.13, 0.01), Vec3(0.04, 0.02, 0.12)};
  mesh.tets = {{0, 1, 2, 3}};
  std::vector<Vec3> coarse_X;
  const LevelTransfer t = transfer_of(mesh, random_matrix(mesh), {Vec3::Zero(), Vec3::Constant(0.1)}, coarse_X);
  EXPECT_EQ(t.coarse_count(), 1);
  for (float w : t.weight) EXPECT_EQ(w, 1);
}

std::vector<float> rounded(const BlockSparseMatrix<double>& A) {
  return {A.values(), A.values() + 9 * A.block_count() + 1};
}

TEST(GalerkinProduct, IsTheTripleProductAndTheSameForTwoThreads) {
  TetMesh mesh = test::kuhn_lattice({7, 4, 5}, 0.1);
  const auto A = random_matrix(mesh);
  std::vector<Vec3> coarse_X;
  const LevelTransfer t = transfer_of(mesh, A, {Vec3(0.02, 0, -0.01), Vec3::Constant(0.2)}, coarse_X);
  BlockSparseMatrix<float> A_c;
  const GalerkinProduct product({A.row_start(), A.columns()}, t, A_c);
  const std::vector<float> values = rounded(A);
  product.update(values.data(), A.diagonal(), A_c, kOne);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(3 * t.fine_count(), 3 * t.coarse_count());
  for (int i = 0; i < t.fine_count(); ++i)
    for (int k = t.row_start[i]; k < t.row_start[i + 1]; ++k)
      P.block<3, 3>(3 * i, 3 * t.coarse[k]) += double(t.weight[k]) * Mat3::Identity();
  const Eigen::MatrixXd expected = P.transpose() * Eigen::MatrixXd(A.to_sparse()) * P;
  const Eigen::MatrixXd got = Eigen::MatrixXd(A_c.to_sparse());
  EXPECT_LT((got - expected).norm() / expected.norm(), 1e-6);  // single precision
  EXPECT_EQ((got - got.transpose()).norm(), 0);

  BlockSparseMatrix<float> again;
  GalerkinProduct({A.row_start(), A.columns()}, t, again).update(values.data(), A.diagonal(), again, kTwo);
  EXPECT_EQ((Eigen::MatrixXd(again.to_sparse()) - got).norm(), 0);
}

TEST(MultigridHierarchy, FollowsTopologyAndHeldNodes) {
  TetMesh mesh = test::kuhn_lattice({12, 4, 4}, 0.1);
  const auto A = random_matrix(mesh);
  std::vector<char> held(mesh.node_count(), 0);
  MultigridHierarchy hierarchy;
  hierarchy.update(A, mesh.X, held, 1e-3 / 6, kOne);
  ASSERT_GE(hierarchy.levels().size(), 2u);
  EXPECT_EQ(hierarchy.levels()[0].A.rows(), 7 * 3 * 3);
  for (const auto& level : hierarchy.levels()) EXPECT_EQ(level.transfer.coarse_count(), level.A.rows());
  for (int n = 0; n < mesh.node_count(); ++n) held[n] = mesh.X[n].x() < 0.65;
  hierarchy.update(A, mesh.X, held, 1e-3 / 6, kOne);
  EXPECT_EQ(hierarchy.levels()[0].A.rows(), 4 * 3 * 3);
}

}  // namespace
}  // namespace crumple::sim::linear_solver
