#include "server/sim/linear_solver/supernodal_solve.h"

#include "server/sim/linear_solver/supernodes.h"
#include "server/sim/quad.h"

#include <algorithm>
#include <cstring>

namespace crumple::sim::linear_solver {
namespace {

int padded(int rows) { return (rows + 3) & ~3; }

// sum_c L_c x_c of Columns columns, `rows` long, onto y.
template <int Columns>
void add_columns(const float* L, int rows, const double* x, double* y) {
  Quad factor[Columns];
  for (int c = 0; c < Columns; ++c) factor[c] = quad(x[c]);
  for (int i = 0; i < rows; i += 4) {
    Quad v = load_four(y + i);
    for (int c = 0; c < Columns; ++c) v = multiply_add(load_four(L + static_cast<std::ptrdiff_t>(c) * rows + i), factor[c], v);
    std::memcpy(y + i, &v, sizeof v);
  }
}

// x_c -= L_c . y
template <int Columns>
void subtract_dots(const float* L, int rows, const double* y, double* x) {
  Quad dot[Columns] = {};
  for (int i = 0; i < rows; i += 4) {
    const Quad v = load_four(y + i);
    for (int c = 0; c < Columns; ++c) dot[c] = multiply_add(load_four(L + static_cast<std::ptrdiff_t>(c) * rows + i), v, dot[c]);
  }
  for (int c = 0; c < Columns; ++c) x[c] -= sum_of_lanes(dot[c])[0];
}

// four(c) for columns c to c + 3, then one(c) for each that is left.
template <class Four, class One>
void by_columns(int width, const Four& four, const One& one) {
  int c = 0;
  for (; c + 4 <= width; c += 4) four(c);
  for (; c < width; ++c) one(c);
}

}  // namespace

SupernodalSolve::SupernodalSolve(const Cholesky& cholesky) {
  Cholesky::Factor factor = cholesky.copy_factor();
  int most = 0;
  for (const Supernode& s : supernodes(factor.L)) {
    const int count = static_cast<int>(s.below.size());
    panels_.push_back({s.first, s.width, count, rows_.size(), own_.size(), below_.size()});
    rows_.insert(rows_.end(), s.below.begin(), s.below.end());
    for (int c = 0; c < s.width; ++c) {
      const auto own = own_values(factor.L, s, c), below = below_values(factor.L, s, c);
      inverse_.push_back(1 / own[0]);
      for (const double value : own.subspan(1)) own_.push_back(static_cast<float>(value));
      for (const double value : below) below_.push_back(static_cast<float>(value));
      below_.resize(below_.size() + static_cast<std::size_t>(padded(count) - count), 0.0f);
    }
    most = std::max(most, padded(count));
  }
  order_ = std::move(factor.order);
  y_.resize(order_.size());
  panel_.resize(most);
}

// y := L^-1 y of the panel's columns, taken off the rows below.
void SupernodalSolve::forward(const Panel& panel) {
  double* x = y_.data() + panel.first;
  const float* L = own_.data() + panel.own_start;
  for (int c = 0; c < panel.width; L += panel.width - 1 - c, ++c) {
    x[c] *= inverse_[panel.first + c];
    for (int k = c + 1; k < panel.width; ++k) x[k] -= static_cast<double>(L[k - c - 1]) * x[c];
  }
  const int rows = padded(panel.row_count);
  std::fill_n(panel_.begin(), rows, 0.0);
  const float* below = below_.data() + panel.below_start;
  const auto at = [&](int c) { return below + static_cast<std::ptrdiff_t>(c) * rows; };
  by_columns(panel.width, [&](int c) { add_columns<4>(at(c), rows, x + c, panel_.data()); },
             [&](int c) { add_columns<1>(at(c), rows, x + c, panel_.data()); });
  const int* row = rows_.data() + panel.row_start;
  for (int r = 0; r < panel.row_count; ++r) y_[row[r]] -= panel_[r];
}

// y := L^-T y of the panel's columns, the rows below known.
void SupernodalSolve::backward(const Panel& panel) {
  double* x = y_.data() + panel.first;
  const int rows = padded(panel.row_count);
  const int* row = rows_.data() + panel.row_start;
  for (int r = 0; r < panel.row_count; ++r) panel_[r] = y_[row[r]];
  std::fill(panel_.begin() + panel.row_count, panel_.begin() + rows, 0.0);
  const float* below = below_.data() + panel.below_start;
  const auto at = [&](int c) { return below + static_cast<std::ptrdiff_t>(c) * rows; };
  by_columns(panel.width, [&](int c) { subtract_dots<4>(at(c), rows, panel_.data(), x + c); },
             [&](int c) { subtract_dots<1>(at(c), rows, panel_.data(), x + c); });
  const float* L = own_.data() + panel.own_start + static_cast<std::size_t>(panel.width) * (panel.width - 1) / 2;
  for (int c = panel.width - 1; c >= 0; --c) {
    L -= panel.width - 1 - c;
    for (int k = c + 1; k < panel.width; ++k) x[c] -= static_cast<double>(L[k - c - 1]) * x[k];
    x[c] *= inverse_[panel.first + c];
  }
}

void SupernodalSolve::solve(const double* b, double* x) {
  for (int i = 0; i < size(); ++i) y_[i] = b[order_[i]];
  for (const Panel& panel : panels_) forward(panel);
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) backward(*panel);
  for (int i = 0; i < size(); ++i) x[order_[i]] = y_[i];
}

}  // namespace crumple::sim::linear_solver
