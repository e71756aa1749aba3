#pragma once

#include "server/sim/linear_solver/block_sparse_matrix.h"

#include <Eigen/SparseCore>

#include <memory>
#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// Direct solver A x = b of a symmetric positive definite sparse matrix: CHOLMOD where the build has it, Eigen's
// LDL^T where not. The symbolic analysis is kept as long as the pattern stays.
class Cholesky {
 public:
  // Order in which unknowns are eliminated. automatic: the library's choice, quick to make. nested_dissection: takes
  // longer to find and fills in less where the unknowns are a solid's; as automatic where the build cannot do it.
  enum class Ordering { automatic, nested_dissection };
  explicit Cholesky(Ordering ordering = Ordering::automatic);
  ~Cholesky();
  Cholesky(Cholesky&&) noexcept;
  Cholesky& operator=(Cholesky&&) noexcept;

  // Reads the lower triangle of A (square, both triangles may be stored). False if A is not positive definite:
  // indefinite, singular or not finite; solve() is then not allowed.
  [[nodiscard]] bool factor(const Eigen::SparseMatrix<double>& A);
  [[nodiscard]] bool factor(const BlockSparseMatrix<double>& A);
  [[nodiscard]] bool factor(const BlockSparseMatrix<float>& A);
  // As if unknowns of a lower stage were eliminated first, whatever the ordering (those that do not meet may change places); stage: one
  // an unknown, of 0 .. n - 1. Without CHOLMOD as without stages.
  [[nodiscard]] bool factor(const Eigen::SparseMatrix<double>& A, std::span<const int> stage);

  // x = A^-1 b after a factor() that returned true.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

  // A copy of the factor, P A P^T = L L^T, after a factor() that returned true.
  struct Factor {
    Eigen::SparseMatrix<double> L;  // lower triangle, rows of a column ascending
    std::vector<int> order;         // row i of P A P^T is row order[i] of A
  };
  Factor copy_factor() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple::sim::linear_solver
