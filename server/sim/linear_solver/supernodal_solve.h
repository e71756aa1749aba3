#pragma once

#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/parallel_for.h"

#include <array>
#include <cstddef>
#include <vector>

namespace crumple::sim::linear_solver {

// x = A^-1 b, one right-hand side at a time, as a preconditioner has it: the factor of a Cholesky in single precision, which halves
// what a solve reads and is all that it waits for; products and sums in double. So x = (L L^T)^-1 b to rounding in double of a
// rounded L: a symmetric positive definite map whatever A's condition is. Of supernodes the rows below are a dense panel.
// The elimination tree of a large factor is cut into two branches, which are substituted side by side, and a trunk that both end in.
class SupernodalSolve {
 public:
  SupernodalSolve() = default;
  // After a factor() that returned true; later ones do not change it.
  explicit SupernodalSolve(const Cholesky& cholesky);

  int size() const { return static_cast<int>(order_.size()); }
  double longest_share() const { return longest_share_; }  // as TreeCut has it

  // b, x: n. Not from two threads at once. Bits do not depend on the number of threads.
  void solve(const double* b, double* x, const ThreadPool& pool);

 private:
  struct Panel {
    int first, width, row_count;
    std::size_t row_start, own_start, below_start;
  };
  // Panels of which none has rows below it in the other branch; of these rows, those of the trunk are in a copy of the branch's own.
  struct Branch {
    std::vector<int> panels;      // ascending
    std::vector<double> scratch;  // the most rows of a panel
  };
  void forward(const Panel& panel, std::vector<double>& scratch);
  void backward(const Panel& panel, std::vector<double>& scratch);
  void grow_branches();

  std::vector<Panel> panels_;
  std::vector<int> rows_;          // of each panel, below it: ids in y_
  std::vector<float> own_;         // a panel's own rows: column by column below the diagonal
  std::vector<double> inverse_;    // of the diagonal, one a column
  std::vector<float> below_;       // the rows below: column by column, each padded to whole quads
  std::vector<int> order_;         // row i of the factor is row order_[i] of A
  std::array<Branch, 2> branches_;
  Branch trunk_;                   // all panels, where two branches are not worth it
  std::vector<int> trunk_columns_;
  double longest_share_ = 1;
  std::vector<double> y_;          // n, then the trunk's columns once for each branch
};

}  // namespace crumple::sim::linear_solver
