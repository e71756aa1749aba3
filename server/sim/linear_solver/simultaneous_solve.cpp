#include "server/sim/linear_solver/simultaneous_solve.h"

#include <cassert>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kWidth = 16;  // two lines of the cache a row

}  // namespace

SimultaneousSolve::SimultaneousSolve(const Cholesky& cholesky) {
  Cholesky::Factor factor = cholesky.copy_factor();
  by_column_ = std::move(factor.L);
  by_row_ = by_column_;
  order_ = std::move(factor.order);
}

void SimultaneousSolve::solve_in_place(RowMatrix& B, const ThreadPool& pool) const {
  assert(B.rows() == by_column_.rows());
  const int columns = static_cast<int>(B.cols());
  pool.for_chunks(columns, kWidth, [&](int begin, int end) {
    int at = begin;
    for (; at + 16 <= end; at += 16) substitute<16>(B, at);
    for (; at + 4 <= end; at += 4) substitute<4>(B, at);
    for (; at < end; ++at) substitute<1>(B, at);
  });
}

template <int Width>
void SimultaneousSolve::substitute(RowMatrix& B, int first) const {
  using Values = Eigen::Array<double, Width, 1>;
  const int n = static_cast<int>(B.rows());
  std::vector<Values> x(n);
  for (int i = 0; i < n; ++i) x[i] = B.row(order_[i]).template segment<Width>(first).transpose();

  for (int i = 0; i < n; ++i) {  // L y = b; a row ends with its diagonal
    const int last = by_row_.outerIndexPtr()[i + 1] - 1;
    Values sum = x[i];
    for (int k = by_row_.outerIndexPtr()[i]; k < last; ++k)
      sum -= by_row_.valuePtr()[k] * x[by_row_.innerIndexPtr()[k]];
    x[i] = sum / by_row_.valuePtr()[last];
  }
  for (int i = n - 1; i >= 0; --i) {  // L^T x = y; a column begins with its diagonal
    const int first_k = by_column_.outerIndexPtr()[i], end = by_column_.outerIndexPtr()[i + 1];
    Values sum = x[i];
    for (int k = first_k + 1; k < end; ++k) sum -= by_column_.valuePtr()[k] * x[by_column_.innerIndexPtr()[k]];
    x[i] = sum / by_column_.valuePtr()[first_k];
  }

  for (int i = 0; i < n; ++i) B.row(order_[i]).template segment<Width>(first) = x[i].transpose();
}

}  // namespace crumple::sim::linear_solver
