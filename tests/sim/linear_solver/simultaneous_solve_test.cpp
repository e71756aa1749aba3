#include "server/sim/linear_solver/simultaneous_solve.h"

#include <gtest/gtest.h>

namespace crumple::sim::linear_solver {
namespace {

// -(u_xx + u_yy) on an n x n grid between fixed edges, plus 0.1 of the identity: the factor fills in.
Eigen::SparseMatrix<double> grid(int n) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto id = [n](int i, int j) { return i * n + j; };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      entries.emplace_back(id(i, j), id(i, j), 4.1);
      for (const auto& [a, b] : {std::pair(i + 1, j), {i, j + 1}})
        if (a < n && b < n) entries.emplace_back(id(i, j), id(a, b), -1), entries.emplace_back(id(a, b), id(i, j), -1);
    }
  Eigen::SparseMatrix<double> A(n * n, n * n);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

TEST(SimultaneousSolve, FactorTimesItsTransposeIsTheMatrix) {
  const Eigen::SparseMatrix<double> A = grid(7);
  Cholesky cholesky;
  ASSERT_TRUE(cholesky.factor(A));
  const auto [L, order] = cholesky.copy_factor();
  const Eigen::MatrixXd product = Eigen::MatrixXd(L) * Eigen::MatrixXd(L).transpose();
  for (int i = 0; i < A.rows(); ++i)
    for (int j = 0; j < A.rows(); ++j) EXPECT_NEAR(product(i, j), A.coeff(order[i], order[j]), 1e-13);
}

TEST(SimultaneousSolve, AnyOrderingSolvesTheSameSystem) {
  const Eigen::SparseMatrix<double> A = grid(30);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
  for (const auto ordering : {Cholesky::Ordering::automatic, Cholesky::Ordering::nested_dissection}) {
    Cholesky cholesky(ordering);
    ASSERT_TRUE(cholesky.factor(A));
    EXPECT_LT((A * cholesky.solve(b) - b).cwiseAbs().maxCoeff(), 1e-12);
    Eigen::SparseMatrix<double> singular = A;
    singular.coeffRef(5, 5) = -4;
    EXPECT_FALSE(cholesky.factor(singular));
    ASSERT_TRUE(cholesky.factor(A));  // as if nothing had happened
    EXPECT_LT((A * cholesky.solve(b) - b).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(SimultaneousSolve, EveryColumnSolvesTheSystemForAnyNumberOfThreads) {
  const Eigen::SparseMatrix<double> A = grid(20);
  Cholesky cholesky;
  ASSERT_TRUE(cholesky.factor(A));
  const SimultaneousSolve solve(cholesky);
  for (const int columns : {1, 3, 16, 39}) {  // every width of block
    const RowMatrix B = RowMatrix::Random(A.rows(), columns);
    RowMatrix X = B, again = B;
    solve.solve_in_place(X, ThreadPool(1));
    solve.solve_in_place(again, ThreadPool(2));
    EXPECT_LT((A * X - B).cwiseAbs().maxCoeff(), 1e-12) << columns;  // condition 80
    EXPECT_EQ(X, again) << columns;
  }
}

}  // namespace
}  // namespace crumple::sim::linear_solver
