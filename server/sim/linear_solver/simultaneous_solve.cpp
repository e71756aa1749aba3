#include "server/sim/linear_solver/simultaneous_solve.h"

#include "server/sim/linear_solver/supernodes.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kWidth = 16;  // two lines of the cache a row

}  // namespace

SimultaneousSolve::SimultaneousSolve(const Cholesky& cholesky) {
  Cholesky::Factor factor = cholesky.copy_factor();
  const Eigen::SparseMatrix<double>& L = factor.L;
  for (const Supernode& s : supernodes(L)) {
    const int width = s.width, count = static_cast<int>(s.below.size());
    const auto entry = [&](int row, int c) { return below_values(L, s, c)[row]; };
    panels_.push_back({s.first, width, count, rows_.size(), own_.size(), by_row_.size()});
    rows_.insert(rows_.end(), s.below.begin(), s.below.end());
    for (int c = 0; c < width; ++c) {
      const std::span<const double> own = own_values(L, s, c);
      own_.insert(own_.end(), own.begin(), own.end());
    }
    for (int r = 0; r < count; r += 2)
      for (int c = 0; c < width; ++c)
        for (int k = r; k < std::min(r + 2, count); ++k) by_row_.push_back(entry(k, c));
    for (int c = 0; c < width; c += 2)
      for (int r = 0; r < count; ++r)
        for (int k = c; k < std::min(c + 2, width); ++k) by_column_.push_back(entry(r, k));
  }
  order_ = std::move(factor.order);
}

void SimultaneousSolve::solve_in_place(RowMatrix& B, const ThreadPool& pool) const {
  assert(B.rows() == static_cast<Eigen::Index>(order_.size()));
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

  for (const Panel& panel : panels_) {  // L y = b
    Values* own = x.data() + panel.first;
    const int w = panel.width;
    const double* L = own_.data() + panel.own_start;
    for (int c = 0; c < w; L += w - c, ++c) {
      own[c] /= L[0];
      for (int k = c + 1; k < w; ++k) own[k] -= L[k - c] * own[c];
    }
    const int* row = rows_.data() + panel.row_start;
    L = by_row_.data() + panel.below_start;
    int r = 0;
    for (; r + 1 < panel.row_count; r += 2, L += 2 * w) {
      Values a = x[row[r]], b = x[row[r + 1]];
      for (int k = 0; k < w; ++k) {
        a -= L[2 * k] * own[k];
        b -= L[2 * k + 1] * own[k];
      }
      x[row[r]] = a;
      x[row[r + 1]] = b;
    }
    if (r == panel.row_count) continue;
    Values a = x[row[r]];
    for (int k = 0; k < w; ++k) a -= L[k] * own[k];
    x[row[r]] = a;
  }
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {  // L^T x = y
    Values* own = x.data() + panel->first;
    const int w = panel->width, count = panel->row_count;
    const int* row = rows_.data() + panel->row_start;
    const double* L = by_column_.data() + panel->below_start;
    int c = 0;
    for (; c + 1 < w; c += 2, L += 2 * count) {
      Values a = own[c], b = own[c + 1];
      for (int r = 0; r < count; ++r) {
        a -= L[2 * r] * x[row[r]];
        b -= L[2 * r + 1] * x[row[r]];
      }
      own[c] = a;
      own[c + 1] = b;
    }
    if (c < w) {
      Values a = own[c];
      for (int r = 0; r < count; ++r) a -= L[r] * x[row[r]];
      own[c] = a;
    }
    L = own_.data() + panel->own_start + static_cast<std::size_t>(w) * (w + 1) / 2;
    for (c = w - 1; c >= 0; --c) {
      L -= w - c;
      Values a = own[c];
      for (int k = c + 1; k < w; ++k) a -= L[k - c] * own[k];
      own[c] = a / L[0];
    }
  }

  for (int i = 0; i < n; ++i) B.row(order_[i]).template segment<Width>(first) = x[i].transpose();
}

}  // namespace crumple::sim::linear_solver
