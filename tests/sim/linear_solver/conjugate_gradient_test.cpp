#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/block_sparse_matrix.h"
#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/linear_solver/conjugate_gradient.h"
#include "tests/sim/linear_solver/tet_edges.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <limits>

namespace crumple::sim::linear_solver {
namespace {

const ThreadPool kOne(1);

// -u'' = 1 on a chain of n nodes between two fixed ends: u_i = i (n + 1 - i) / 2, i = 1..n.
void chain(const Eigen::VectorXd& u, Eigen::VectorXd& out) {
  const Eigen::Index n = u.size();
  for (Eigen::Index i = 0; i < n; ++i) out[i] = 2 * u[i] - (i > 0 ? u[i - 1] : 0) - (i + 1 < n ? u[i + 1] : 0);
}
void no_preconditioner(const Eigen::VectorXd& r, Eigen::VectorXd& z) { z = r; }

Eigen::VectorXd chain_solution(int n) {
  return Eigen::VectorXd::NullaryExpr(n, [n](Eigen::Index i) { return 0.5 * (i + 1) * (n - i); });
}

// Springs between nodes that share a tet, on a strip of tets, plus masses: symmetric positive definite.
BlockSparseMatrix<double> spring_strip(int tet_count) {
  std::vector<Tet> tets;
  for (int t = 0; t < tet_count; ++t) tets.push_back({t, t + 1, t + 2, t + 3});
  auto A = BlockSparseMatrix<double>::from_edges(tet_count + 3, edges_of(tets));
  for (int i = 0; i < A.rows(); ++i) A.diagonal()[i] += (0.01 + 1e-3 * (i % 7)) * Mat3::Identity();
  for (int i = 0; i < A.rows(); ++i)
    for (int k = A.row_start()[i]; k < A.row_start()[i + 1]; ++k) {
      const int j = A.columns()[k];
      const Vec3 d = Vec3(1, 0.3 * ((i + j) % 5), 0.2 * ((i * j) % 3)).normalized();
      const Mat3 K = (1 + (i + j) % 4) * d * d.transpose() + 0.1 * Mat3::Identity();
      A.set_block(k, -K);
      A.diagonal()[i] += K;
    }
  return A;
}

SolveReport solve(const BlockSparseMatrix<double>& A, const Eigen::VectorXd& b, Eigen::VectorXd& x,
                  const SolveOptions& options, const ThreadPool& pool) {
  BlockJacobi jacobi;
  jacobi.assign(A.diagonal());
  jacobi.invert(pool);
  CgWorkspace workspace;
  return conjugate_gradient([&](const auto& in, auto& out) { A.multiply(in, out, pool); },
                            [&](const auto& in, auto& out) { jacobi.apply(in, out, pool); }, b, x, options, workspace,
                            pool);
}

// A preconditioner that is near the inverse is asked once an iteration and once at the end; what it says is the energy norm of
// what is missing, relative to that of the solution.
TEST(ConjugateGradient, NearInverseIsMeasuredAgainstTheSolutionAndAskedForNothingElse) {
  const auto A = spring_strip(60);
  const Eigen::MatrixXd dense = A.to_sparse();
  const Eigen::MatrixXd inverse = dense.inverse();
  Eigen::VectorXd b(dense.rows());
  for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = std::sin(1.0 + i);
  const Eigen::VectorXd solution = inverse * b;
  for (double start : {0.0, 0.5, -1.0, 1000.0}) {
    int asked = 0;
    const auto nearly = [&](const Eigen::VectorXd& r, Eigen::VectorXd& z) {
      ++asked;
      z = 0.7 * (inverse * r) + 0.01 * r;
    };
    Eigen::VectorXd x = start * Eigen::VectorXd::Ones(b.size());
    CgWorkspace workspace;
    const SolveReport report = conjugate_gradient([&](const auto& in, auto& out) { A.multiply(in, out, kOne); }, nearly, b, x,
                                                  {.tolerance = 1e-4, .near_inverse = true}, workspace, kOne);
    EXPECT_TRUE(report.converged);
    EXPECT_EQ(asked, report.iterations + 1);
    // The preconditioner is 0.7 times the inverse and a little.
    const Eigen::VectorXd error = x - solution;
    const double relative = std::sqrt(error.dot(dense * error) / solution.dot(b));
    EXPECT_GT(report.residual, 0.7 * relative);
    EXPECT_LT(report.residual, 1.5 * relative);
  }
  // b = 0, whatever the guess.
  Eigen::VectorXd x = Eigen::VectorXd::Ones(b.size());
  CgWorkspace workspace;
  EXPECT_TRUE(conjugate_gradient([&](const auto& in, auto& out) { A.multiply(in, out, kOne); }, no_preconditioner,
                                 Eigen::VectorXd::Zero(b.size()), x, {.near_inverse = true}, workspace, kOne).converged);
  EXPECT_EQ(x.norm(), 0);
}

TEST(ConjugateGradient, SolvesTheChainInClosedForm) {
  const int n = 50;
  CgWorkspace workspace;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
  const SolveReport report =
      conjugate_gradient(chain, no_preconditioner, Eigen::VectorXd::Ones(n), u, {1e-12, 200}, workspace, kOne);
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.iterations, n);  // exact arithmetic ends within n steps
  EXPECT_LT((u - chain_solution(n)).norm(), 1e-11 * chain_solution(n).norm());
}

TEST(ConjugateGradient, AgreesWithCholesky) {
  const auto A = spring_strip(400);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * A.rows(), -1, 2);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  ASSERT_TRUE(solve(A, b, x, {1e-13, 5000}, kOne).converged);
  Cholesky direct;
  ASSERT_TRUE(direct.factor(A));
  const Eigen::VectorXd exact = direct.solve(b);
  EXPECT_LT((A.to_sparse() * exact - b).norm(), 1e-12 * b.norm());
  EXPECT_LT((x - exact).norm(), 1e-9 * exact.norm());  // tolerance times the condition number, about 1e4
}

TEST(ConjugateGradient, CapIsReportedWithTheResidualReached) {
  const auto A = spring_strip(400);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * A.rows(), -1, 2);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  const SolveReport report = solve(A, b, x, {1e-13, 5}, kOne);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 5);
  const auto norm = [&](const Eigen::VectorXd& r) {
    double sum = 0;
    for (int i = 0; i < A.rows(); ++i) sum += r.segment<3>(3 * i).dot(A.diagonal()[i].inverse() * r.segment<3>(3 * i));
    return std::sqrt(sum);
  };
  EXPECT_NEAR(report.residual, norm(b - A.to_sparse() * x) / norm(b), 1e-10);
}

TEST(ConjugateGradient, StartsFromTheGuess) {
  const int n = 50;
  CgWorkspace workspace;
  Eigen::VectorXd u = chain_solution(n);
  EXPECT_EQ(conjugate_gradient(chain, no_preconditioner, Eigen::VectorXd::Ones(n), u, {1e-12, 200}, workspace, kOne)
                .iterations,
            0);
  EXPECT_EQ(u, chain_solution(n));
}

TEST(ConjugateGradient, ZeroRightHandSideGivesZero) {
  CgWorkspace workspace;
  Eigen::VectorXd u = Eigen::VectorXd::Ones(10);
  const SolveReport report =
      conjugate_gradient(chain, no_preconditioner, Eigen::VectorXd::Zero(10), u, {}, workspace, kOne);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(u, Eigen::VectorXd::Zero(10));
}

TEST(ConjugateGradient, NotFiniteInputLeavesTheGuessAndIsReported) {
  CgWorkspace workspace;
  Eigen::VectorXd b = Eigen::VectorXd::Ones(10), u = Eigen::VectorXd::Ones(10);
  b[3] = std::numeric_limits<double>::quiet_NaN();
  const SolveReport bad_b = conjugate_gradient(chain, no_preconditioner, b, u, {}, workspace, kOne);
  EXPECT_FALSE(bad_b.converged);
  EXPECT_TRUE(std::isnan(bad_b.residual));
  EXPECT_EQ(u, Eigen::VectorXd::Ones(10));

  const auto bad_map = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out = in * b[3]; };
  EXPECT_FALSE(
      conjugate_gradient(bad_map, no_preconditioner, Eigen::VectorXd::Ones(10), u, {}, workspace, kOne).converged);
  EXPECT_TRUE(u.allFinite());
}

TEST(ConjugateGradient, IndefiniteMatrixEndsTheSolve) {
  CgWorkspace workspace;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(10);
  const auto negative = [](const Eigen::VectorXd& in, Eigen::VectorXd& out) { out = -in; };
  const SolveReport report =
      conjugate_gradient(negative, no_preconditioner, Eigen::VectorXd::Ones(10), u, {}, workspace, kOne);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 0);
  EXPECT_EQ(u, Eigen::VectorXd::Zero(10));
}

TEST(ConjugateGradient, SystemWithoutSolutionEndsLongBeforeTheCap) {
  // A chain with free ends cannot take a net force; an unsymmetric map makes residuals grow.
  const auto free_chain = [](const Eigen::VectorXd& u, Eigen::VectorXd& out) {
    chain(u, out);
    out[0] -= u[0];
    out[u.size() - 1] -= u[u.size() - 1];
  };
  const auto turning = [](const Eigen::VectorXd& u, Eigen::VectorXd& out) {
    out = 1e-3 * u;
    out[0] += u[1];
    out[1] -= u[0];
  };
  CgWorkspace workspace;
  for (const LinearMap& map : {LinearMap(free_chain), LinearMap(turning)}) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(30);
    const SolveReport report = conjugate_gradient(map, no_preconditioner, Eigen::VectorXd::LinSpaced(30, -1, 2), u,
                                                  {1e-10, 100000}, workspace, kOne);
    EXPECT_FALSE(report.converged);
    EXPECT_LT(report.iterations, 1000);
    EXPECT_TRUE(u.allFinite());
  }
}

TEST(ConjugateGradient, UncoupledEntryThatSolvesItsRowKeepsItsBits) {
  auto A = spring_strip(100);
  const double prescribed = 1.0 / 3;
  Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * A.rows(), -1, 2);
  for (int k = A.row_start()[5]; k < A.row_start()[6]; ++k) {
    A.set_block(A.find(A.columns()[k], 5), Mat3::Zero());
    A.set_block(k, Mat3::Zero());
  }
  A.diagonal()[5] = 0.7 * Mat3::Identity();
  b.segment<3>(15).setConstant(0.7 * prescribed);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  x.segment<3>(15).setConstant(prescribed);
  ASSERT_TRUE(solve(A, b, x, {1e-10, 5000}, kOne).converged);
  EXPECT_EQ(Vec3(x.segment<3>(15)), Vec3::Constant(prescribed));
}

TEST(ConjugateGradient, ABlockDiagonalPreconditionerInTheLoopOfTheResidualGivesTheSameBits) {
  const auto A = spring_strip(1500);
  const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(3 * A.rows(), [](Eigen::Index i) { return std::sin(0.3 + i); });
  const ThreadPool two(2);
  Eigen::VectorXd apart = Eigen::VectorXd::Zero(b.size()), together = apart;
  const SolveReport report = solve(A, b, apart, {1e-8, 2000}, kOne);
  ASSERT_TRUE(report.converged);
  BlockJacobi jacobi;
  jacobi.assign(A.diagonal());
  jacobi.invert(two);
  CgWorkspace workspace;
  int asked = 0;
  const auto precondition = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    ++asked;
    jacobi.apply(in, out, two);
  };
  const auto blocks = [&](int begin, int end, const Eigen::VectorXd& in, Eigen::VectorXd& out) { jacobi.apply_blocks(begin, end, in.data(), out.data()); };
  const SolveReport again = conjugate_gradient([&](const auto& in, auto& out) { A.multiply(in, out, two); }, precondition, b, together,
                                               {1e-8, 2000}, workspace, two, {}, blocks);
  EXPECT_EQ(again.iterations, report.iterations);
  EXPECT_EQ(together, apart);
  EXPECT_EQ(asked, 2);  // of b and the first residual
}

TEST(ConjugateGradient, AProductThatFindsItsDotOnTheWaySolvesAsWell) {
  const auto A = spring_strip(1500);
  const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(3 * A.rows(), [](Eigen::Index i) { return std::sin(0.3 + i); });
  Eigen::VectorXd apart = Eigen::VectorXd::Zero(b.size()), together = apart;
  const SolveReport report = solve(A, b, apart, {1e-8, 2000}, kOne);
  ASSERT_TRUE(report.converged);
  BlockJacobi jacobi;
  jacobi.assign(A.diagonal());
  jacobi.invert(kOne);
  int products = 0;
  const auto apply = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { A.multiply(in, out, kOne); };
  const auto apply_and_dot = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    ++products;
    A.multiply(in, out, kOne);
    return in.dot(out);
  };
  CgWorkspace workspace;
  const SolveReport again = conjugate_gradient(apply, [&](const auto& in, auto& out) { jacobi.apply(in, out, kOne); }, b, together,
                                               {1e-8, 2000}, workspace, kOne, {}, {}, apply_and_dot);
  EXPECT_TRUE(again.converged);
  EXPECT_EQ(products, again.iterations);
  EXPECT_NEAR(again.iterations, report.iterations, 3);
  EXPECT_LT((together - apart).norm(), 1e-6 * apart.norm());
}

TEST(ConjugateGradient, HasTheSameBitsForOneAndTwoThreads) {
  const auto A = spring_strip(3000);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * A.rows(), -1, 2);
  Eigen::VectorXd one = Eigen::VectorXd::Zero(b.size()), two = one;
  const SolveReport report = solve(A, b, one, {1e-8, 5000}, kOne);
  EXPECT_EQ(report.iterations, solve(A, b, two, {1e-8, 5000}, ThreadPool(2)).iterations);
  EXPECT_EQ(one, two);
}

TEST(BlockJacobi, InvertsBlocksAndCallersMayAddToThem) {
  const std::vector<Mat3> diagonal(2, 2 * Mat3::Identity());
  BlockJacobi jacobi;
  jacobi.assign(diagonal);
  jacobi.blocks()[1] += Vec3(0, 2, 0).asDiagonal();
  jacobi.invert(kOne);
  Eigen::VectorXd z(6);
  jacobi.apply(Eigen::VectorXd::Ones(6), z, kOne);
  EXPECT_EQ(z, (Eigen::VectorXd(6) << 0.5, 0.5, 0.5, 0.5, 0.25, 0.5).finished());
}

TEST(BlockJacobi, BlockThatIsNotPositiveDefiniteBecomesTheIdentity) {
  std::vector<Mat3> diagonal(4, Mat3::Identity());
  diagonal[0].setZero();
  diagonal[1](1, 1) = -1;
  diagonal[2](2, 2) = std::numeric_limits<double>::quiet_NaN();
  diagonal[3] = Vec3(-1, -1, 1).asDiagonal();
  BlockJacobi jacobi;
  jacobi.assign(diagonal);
  jacobi.invert(kOne);
  for (const Mat3& inverse : jacobi.blocks()) EXPECT_EQ(inverse, Mat3::Identity());
}

}  // namespace
}  // namespace crumple::sim::linear_solver
