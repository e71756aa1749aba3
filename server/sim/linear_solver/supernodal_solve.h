#pragma once

#include "server/sim/linear_solver/cholesky.h"

#include <cstddef>
#include <vector>

namespace crumple::sim::linear_solver {

// x = A^-1 b, one right-hand side at a time, as a preconditioner has it: the factor of a Cholesky in single precision, which halves
// what a solve reads and is all that it waits for; products and sums in double. So x = (L L^T)^-1 b to rounding in double of a
// rounded L: a symmetric positive definite map whatever A's condition is. Of supernodes the rows below are a dense panel.
class SupernodalSolve {
 public:
  SupernodalSolve() = default;
  // After a factor() that returned true; later ones do not change it.
  explicit SupernodalSolve(const Cholesky& cholesky);

  int size() const { return static_cast<int>(order_.size()); }

  // b, x: n. Not from two threads at once. One thread: the bits are those of the input.
  void solve(const double* b, double* x);

 private:
  struct Panel {
    int first, width, row_count;
    std::size_t row_start, own_start, below_start;
  };
  void forward(const Panel& panel);
  void backward(const Panel& panel);

  std::vector<Panel> panels_;
  std::vector<int> rows_;          // of each panel, below it
  std::vector<float> own_;         // a panel's own rows: column by column below the diagonal
  std::vector<double> inverse_;    // of the diagonal, one a column
  std::vector<float> below_;       // the rows below: column by column, each padded to whole quads
  std::vector<int> order_;         // row i of the factor is row order_[i] of A
  std::vector<double> y_, panel_;  // scratch: n; the most rows of a panel
};

}  // namespace crumple::sim::linear_solver
