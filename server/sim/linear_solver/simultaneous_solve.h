#pragma once

#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/parallel_for.h"

namespace crumple::sim::linear_solver {

// A row of values a node, side by side in memory: every entry of a factor is loaded once for many of them.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// X = A^-1 B for many right-hand sides at once, with the factor of a Cholesky: forward and backward substitution over
// blocks of sixteen columns in the vector unit, about eight times the rate of one column after another.
class SimultaneousSolve {
 public:
  // After a factor() that returned true; later ones do not change it.
  explicit SimultaneousSolve(const Cholesky& cholesky);

  // B in, X out: n x k. Blocks of columns are solved side by side; the same bits for any number of threads.
  void solve_in_place(RowMatrix& B, const ThreadPool& pool) const;

 private:
  template <int Width>
  void substitute(RowMatrix& B, int first) const;

  Eigen::SparseMatrix<double> by_column_;                // L
  Eigen::SparseMatrix<double, Eigen::RowMajor> by_row_;  // L once more
  std::vector<int> order_;                               // row i of the factor is row order_[i] of A
};

}  // namespace crumple::sim::linear_solver
