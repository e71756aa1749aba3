#pragma once

#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/parallel_for.h"

namespace crumple::sim::linear_solver {

// A row of values a node, side by side in memory: every entry of a factor is loaded once for many of them.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// X = A^-1 B for many right-hand sides at once, with the factor of a Cholesky: forward and backward substitution over
// blocks of sixteen columns in the vector unit. Columns of the factor with the same rows below them are one dense panel
// (a supernode): ids are read once a panel, and two rows or columns of a panel share what they load. Of a biharmonic
// system of 5,000 tet vertices that takes three fifths of the time of a walk along single columns.
class SimultaneousSolve {
 public:
  // After a factor() that returned true; later ones do not change it.
  explicit SimultaneousSolve(const Cholesky& cholesky);

  // B in, X out: n x k. Blocks of columns are solved side by side; the same bits for any number of threads.
  void solve_in_place(RowMatrix& B, const ThreadPool& pool) const;

 private:
  // Columns first .. first + width - 1 of L, which have the same rows below the last of them.
  struct Panel {
    int first, width, row_count;
    std::size_t row_start, own_start, below_start;
  };
  template <int Width>
  void substitute(RowMatrix& B, int first) const;

  std::vector<Panel> panels_;
  std::vector<int> rows_;                   // of each panel, below it
  std::vector<double> own_;                 // rows of a panel's own columns: column by column from the diagonal
  std::vector<double> by_row_, by_column_;  // the rows below: in the order of a walk along pairs of rows, of columns
  std::vector<int> order_;                  // row i of the factor is row order_[i] of A
};

}  // namespace crumple::sim::linear_solver
