#include "server/sim/linear_solver/supernodal_solve.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <vector>

namespace crumple::sim::linear_solver {
namespace {

// A Laplacian of an n x n x n grid with three unknowns a point, coupled, and `mass` times the identity: panels of every width.
Eigen::SparseMatrix<double> solid(int n, double mass) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto id = [n](int i, int j, int k) { return 3 * ((i * n + j) * n + k); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        for (int a = 0; a < 3; ++a) {
          const int row = id(i, j, k) + a;
          double diagonal = mass;
          const std::array<std::array<int, 3>, 3> others{{{i + 1, j, k}, {i, j + 1, k}, {i, j, k + 1}}};
          for (const auto& [p, q, r] : others) {
            if (p >= n || q >= n || r >= n) continue;
            for (int b = 0; b < 3; ++b) {
              const double value = a == b ? -1 : -0.2;
              entries.emplace_back(row, id(p, q, r) + b, value);
              entries.emplace_back(id(p, q, r) + b, row, value);
            }
          }
          diagonal += 8.4;
          entries.emplace_back(row, row, diagonal);
        }
  Eigen::SparseMatrix<double> A(3 * n * n * n, 3 * n * n * n);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

const ThreadPool one(1);

// Of A = solid(n, mass), by stages that leave two halves of it apart. What one thread alone goes through is then half of both and the
// cut between them; Eigen's factor knows no stages.
SupernodalSolve in_halves(const Eigen::SparseMatrix<double>& A, int n, Cholesky& cholesky) {
  std::vector<int> stage;
  for (int i = 0; i < 3 * n * n * n; ++i) {
    const int layer = i / (3 * n * n);
    stage.push_back(layer == n / 2 ? 2 : layer > n / 2);
  }
  EXPECT_TRUE(cholesky.factor(A, stage));
  SupernodalSolve solve(cholesky);
#ifdef CRUMPLE_HAVE_CHOLMOD
  EXPECT_LT(solve.longest_share(), 0.75);
#endif
  return solve;
}

// x = A^-1 b, not in place and in place.
Eigen::VectorXd both_ways(SupernodalSolve& solve, const Eigen::VectorXd& b, const ThreadPool& pool) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size()), in_place = b;
  solve.solve(b.data(), x.data(), pool);
  solve.solve(in_place.data(), in_place.data(), pool);
  EXPECT_EQ(x, in_place);
  return x;
}

TEST(SupernodalSolve, SolvesTheSystemToSinglePrecision) {
  for (const int n : {1, 2, 5, 9})
    for (const auto ordering : {Cholesky::Ordering::automatic, Cholesky::Ordering::nested_dissection}) {
      const Eigen::SparseMatrix<double> A = solid(n, 0.1);
      Cholesky cholesky(ordering);
      ASSERT_TRUE(cholesky.factor(A));
      SupernodalSolve solve(cholesky);
      const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
      Eigen::VectorXd x(b.size());
      solve.solve(b.data(), x.data(), one);
      const Eigen::VectorXd exact = cholesky.solve(b);
      EXPECT_LT((x - exact).norm(), 1e-5 * exact.norm()) << n;  // condition below 100
    }
}

TEST(SupernodalSolve, IsSymmetricToDoublePrecisionWhateverTheCondition) {
  for (const double mass : {1.0, 1e-6}) {
    const Eigen::SparseMatrix<double> A = solid(4, mass);
    Cholesky cholesky;
    ASSERT_TRUE(cholesky.factor(A));
    SupernodalSolve solve(cholesky);
    Eigen::MatrixXd M(A.rows(), A.cols());
    for (Eigen::Index k = 0; k < M.cols(); ++k) {
      const Eigen::VectorXd e = Eigen::VectorXd::Unit(M.cols(), k);
      solve.solve(e.data(), M.col(k).data(), one);
    }
    EXPECT_LT((M - M.transpose()).norm(), 1e-13 * M.norm());
    EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(0.5 * (M + M.transpose())).info(), Eigen::Success);
  }
}

TEST(SupernodalSolve, InPlaceIsTheSame) {
  const Eigen::SparseMatrix<double> A = solid(3, 1);
  Cholesky cholesky;
  ASSERT_TRUE(cholesky.factor(A));
  SupernodalSolve solve(cholesky);
  both_ways(solve, Eigen::VectorXd::LinSpaced(A.rows(), 0, 2), one);
}

TEST(SupernodalSolve, SubstitutesHalvesSideBySideWithTheSameBits) {
  const int n = 9;
  const Eigen::SparseMatrix<double> A = solid(n, 0.1);
  Cholesky cholesky;
  SupernodalSolve solve = in_halves(A, n, cholesky);
  EXPECT_GE(solve.longest_share(), 0.5);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
  const Eigen::VectorXd x = both_ways(solve, b, one);
  EXPECT_LT((x - cholesky.solve(b)).norm(), 1e-5 * x.norm());
  EXPECT_EQ(x, both_ways(solve, b, ThreadPool(3)));
}

// Two parts that do not meet need no cut.
TEST(SupernodalSolve, SolvesPartsThatDoNotMeet) {
  const Eigen::SparseMatrix<double> part = solid(8, 0.1);
  std::vector<Eigen::Triplet<double>> entries;
  for (const Eigen::Index first : {Eigen::Index{0}, part.rows()})
    for (int k = 0; k < part.outerSize(); ++k)
      for (Eigen::SparseMatrix<double>::InnerIterator it(part, k); it; ++it) entries.emplace_back(first + it.row(), first + it.col(), it.value());
  Eigen::SparseMatrix<double> A(2 * part.rows(), 2 * part.rows());
  A.setFromTriplets(entries.begin(), entries.end());
  Cholesky cholesky;
  ASSERT_TRUE(cholesky.factor(A));
  SupernodalSolve solve(cholesky);
  EXPECT_LT(solve.longest_share(), 0.6);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1), exact = cholesky.solve(b);
  EXPECT_LT((both_ways(solve, b, one) - exact).norm(), 1e-5 * exact.norm());
}

TEST(SupernodalSolve, WithBranchesIsSymmetricToDoublePrecision) {
  const int n = 8;
  const Eigen::SparseMatrix<double> A = solid(n, 1e-6);
  Cholesky cholesky;
  SupernodalSolve solve = in_halves(A, n, cholesky);
  const auto inverse_times = [&](const Eigen::VectorXd& b) {
    Eigen::VectorXd x(b.size());
    solve.solve(b.data(), x.data(), one);
    return x;
  };
  std::srand(3);
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd a = Eigen::VectorXd::Random(A.rows()), b = Eigen::VectorXd::Random(A.rows());
    const Eigen::VectorXd Ma = inverse_times(a), Mb = inverse_times(b);
    EXPECT_NEAR(a.dot(Mb), b.dot(Ma), 1e-12 * a.norm() * Mb.norm());
    EXPECT_GT(a.dot(Ma), 0);
  }
}

}  // namespace
}  // namespace crumple::sim::linear_solver
