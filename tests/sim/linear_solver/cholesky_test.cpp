#include "server/sim/linear_solver/cholesky.h"
#include "tests/sim/linear_solver/tet_edges.h"

#include <gtest/gtest.h>

#include <limits>

namespace crumple::sim::linear_solver {
namespace {

// -u'' on n nodes between fixed ends, shifted: its eigenvalues are 2 - 2 cos(k pi / (n + 1)) - shift.
Eigen::SparseMatrix<double> chain(int n, double shift = 0) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i) {
    entries.emplace_back(i, i, 2 - shift);
    if (i + 1 < n) entries.emplace_back(i, i + 1, -1), entries.emplace_back(i + 1, i, -1);
  }
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

TEST(Cholesky, SolvesTheChainInClosedForm) {
  const int n = 200;
  Cholesky direct;
  ASSERT_TRUE(direct.factor(chain(n)));
  const Eigen::VectorXd u = direct.solve(Eigen::VectorXd::Ones(n));
  for (int i = 0; i < n; ++i) EXPECT_NEAR(u[i], 0.5 * (i + 1) * (n - i), 1e-9);  // up to 5e3, condition 1.6e4
}

TEST(Cholesky, TakesAnotherPatternAndOtherValues) {
  Cholesky direct;
  ASSERT_TRUE(direct.factor(chain(5)));
  ASSERT_TRUE(direct.factor(chain(50)));
  const Eigen::SparseMatrix<double> twice = 2 * chain(50);
  ASSERT_TRUE(direct.factor(twice));
  EXPECT_NEAR(direct.solve(Eigen::VectorXd::Ones(50))[0], 12.5, 1e-11);
}

// A chain in two halves and the unknown between them, which comes last.
TEST(Cholesky, TakesStagesAndTakesThemAnew) {
  const int n = 101;
  std::vector<int> stage(n, 0);
  for (int i = n / 2; i < n; ++i) stage[i] = i == n / 2 ? 2 : 1;
  Cholesky direct;
  for (const std::vector<int>& stages : {std::vector<int>(n, 0), stage, std::vector<int>{}}) {
    ASSERT_TRUE(direct.factor(chain(n), stages));
    const Eigen::VectorXd u = direct.solve(Eigen::VectorXd::Ones(n));
    for (int i = 0; i < n; ++i) EXPECT_NEAR(u[i], 0.5 * (i + 1) * (n - i), 1e-9);
#ifdef CRUMPLE_HAVE_CHOLMOD
    if (!stages.empty() && stages[n / 2] == 2) EXPECT_EQ(direct.copy_factor().order.back(), n / 2);
#endif
  }
}

TEST(Cholesky, IndefiniteMatrixIsReportedAndTheNextOneSolved) {
  Cholesky direct;
  EXPECT_FALSE(direct.factor(chain(50, 0.1)));  // smallest eigenvalue of the chain: 0.0038
  EXPECT_TRUE(direct.factor(chain(50, 0.003)));
}

TEST(Cholesky, SingularOrNotFiniteMatrixIsReported) {
  Cholesky direct;
  Eigen::SparseMatrix<double> zero_row = chain(4);
  zero_row.coeffRef(2, 1) = zero_row.coeffRef(1, 2) = zero_row.coeffRef(2, 3) = zero_row.coeffRef(3, 2) = 0;
  zero_row.coeffRef(2, 2) = 0;
  EXPECT_FALSE(direct.factor(zero_row));
  Eigen::SparseMatrix<double> bad = chain(4);
  bad.coeffRef(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(direct.factor(bad));
}

TEST(Cholesky, TakesBlockMatrices) {
  auto A = BlockSparseMatrix<float>::from_edges(4, edges_of({{0, 1, 2, 3}}));
  for (int k = 0; k < A.block_count(); ++k) A.set_block(k, -Mat3::Identity());
  for (Mat3& D : A.diagonal()) D = 4 * Mat3::Identity();  // eigenvalues 1, 5, 5, 5 per axis
  Cholesky direct;
  ASSERT_TRUE(direct.factor(A));
  EXPECT_LT((direct.solve(Eigen::VectorXd::Ones(12)) - Eigen::VectorXd::Ones(12)).norm(), 1e-14);
}

}  // namespace
}  // namespace crumple::sim::linear_solver
