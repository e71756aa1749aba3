#include "server/sim/linear_solver/supernodal_solve.h"

#include "server/sim/linear_solver/supernodes.h"
#include "server/sim/linear_solver/tree_cut.h"
#include "server/sim/quad.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <span>

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
  for (std::vector<float>* values : {&own_, &below_}) values->shrink_to_fit();
  order_ = std::move(factor.order);
  grow_branches();
  y_.resize(order_.size() + branches_.size() * trunk_columns_.size());
  for (Branch* branch : {&branches_[0], &branches_[1], &trunk_}) branch->scratch.resize(most);
}

// Shares out the panels. What a branch takes off the trunk's columns goes to its own copy of them.
void SupernodalSolve::grow_branches() {
  const int count = static_cast<int>(panels_.size());
  std::vector<int> panel_of(order_.size()), parent(count, -1);
  std::vector<std::size_t> work(count);
  for (int p = 0; p < count; ++p) std::fill_n(panel_of.begin() + panels_[p].first, panels_[p].width, p);
  for (int p = 0; p < count; ++p) {
    const Panel& panel = panels_[p];
    work[p] = static_cast<std::size_t>(panel.width) * (panel.width + 1) / 2 + static_cast<std::size_t>(panel.width) * padded(panel.row_count);
    if (panel.row_count > 0) parent[p] = panel_of[rows_[panel.row_start]];
  }
  const TreeCut cut = cut_tree(parent, work);
  longest_share_ = cut.longest_share;
  for (int p = 0; p < count; ++p) (cut.branch[p] < 0 ? trunk_ : branches_[cut.branch[p]]).panels.push_back(p);
  if (branches_[0].panels.empty()) return;

  std::vector<int> in_trunk(order_.size(), -1);
  for (const int p : trunk_.panels)
    for (int c = panels_[p].first; c < panels_[p].first + panels_[p].width; ++c) {
      in_trunk[c] = static_cast<int>(trunk_columns_.size());
      trunk_columns_.push_back(c);
    }
  for (int b = 0; b < 2; ++b)
    for (const int p : branches_[b].panels)
      for (int& row : std::span(rows_).subspan(panels_[p].row_start, panels_[p].row_count))
        if (in_trunk[row] >= 0) row = static_cast<int>(order_.size() + b * trunk_columns_.size()) + in_trunk[row];
}

// y := L^-1 y of the panel's columns, taken off the rows below.
void SupernodalSolve::forward(const Panel& panel, std::vector<double>& scratch) {
  double* x = y_.data() + panel.first;
  const float* L = own_.data() + panel.own_start;
  for (int c = 0; c < panel.width; L += panel.width - 1 - c, ++c) {
    x[c] *= inverse_[panel.first + c];
    for (int k = c + 1; k < panel.width; ++k) x[k] -= static_cast<double>(L[k - c - 1]) * x[c];
  }
  const int rows = padded(panel.row_count);
  std::fill_n(scratch.begin(), rows, 0.0);
  const float* below = below_.data() + panel.below_start;
  const auto at = [&](int c) { return below + static_cast<std::ptrdiff_t>(c) * rows; };
  by_columns(panel.width, [&](int c) { add_columns<4>(at(c), rows, x + c, scratch.data()); },
             [&](int c) { add_columns<1>(at(c), rows, x + c, scratch.data()); });
  const int* row = rows_.data() + panel.row_start;
  for (int r = 0; r < panel.row_count; ++r) y_[row[r]] -= scratch[r];
}

// y := L^-T y of the panel's columns, the rows below known.
void SupernodalSolve::backward(const Panel& panel, std::vector<double>& scratch) {
  double* x = y_.data() + panel.first;
  const int rows = padded(panel.row_count);
  const int* row = rows_.data() + panel.row_start;
  for (int r = 0; r < panel.row_count; ++r) scratch[r] = y_[row[r]];
  std::fill(scratch.begin() + panel.row_count, scratch.begin() + rows, 0.0);
  const float* below = below_.data() + panel.below_start;
  const auto at = [&](int c) { return below + static_cast<std::ptrdiff_t>(c) * rows; };
  by_columns(panel.width, [&](int c) { subtract_dots<4>(at(c), rows, scratch.data(), x + c); },
             [&](int c) { subtract_dots<1>(at(c), rows, scratch.data(), x + c); });
  const float* L = own_.data() + panel.own_start + static_cast<std::size_t>(panel.width) * (panel.width - 1) / 2;
  for (int c = panel.width - 1; c >= 0; --c) {
    L -= panel.width - 1 - c;
    for (int k = c + 1; k < panel.width; ++k) x[c] -= static_cast<double>(L[k - c - 1]) * x[k];
    x[c] *= inverse_[panel.first + c];
  }
}

void SupernodalSolve::solve(const double* b, double* x, const ThreadPool& pool) {
  const std::size_t columns = trunk_columns_.size();
  double* const copies = y_.data() + order_.size();
  const auto load = [&](const Panel& panel) {
    for (int i = panel.first; i < panel.first + panel.width; ++i) y_[i] = b[order_[i]];
  };
  const auto store = [&](const Panel& panel) {
    for (int i = panel.first; i < panel.first + panel.width; ++i) x[order_[i]] = y_[i];
  };
  const auto up = [&](int k, int) {
    Branch& branch = branches_[k];
    std::fill_n(copies + k * columns, columns, 0.0);
    for (const int p : branch.panels) load(panels_[p]);
    for (const int p : branch.panels) forward(panels_[p], branch.scratch);
  };
  const auto down = [&](int k, int) {
    Branch& branch = branches_[k];
    for (auto p = branch.panels.rbegin(); p != branch.panels.rend(); ++p) backward(panels_[*p], branch.scratch);
    for (const int p : branch.panels) store(panels_[p]);
  };
  const int count = branches_[0].panels.empty() ? 0 : static_cast<int>(branches_.size());
  pool.for_chunks(count, 1, std::cref(up));
  for (const int p : trunk_.panels) load(panels_[p]);
  for (std::size_t c = 0; c < columns; ++c) y_[trunk_columns_[c]] += copies[c] + copies[columns + c];
  for (const int p : trunk_.panels) forward(panels_[p], trunk_.scratch);
  for (auto p = trunk_.panels.rbegin(); p != trunk_.panels.rend(); ++p) backward(panels_[*p], trunk_.scratch);
  for (std::size_t c = 0; c < columns; ++c) copies[c] = copies[columns + c] = y_[trunk_columns_[c]];
  pool.for_chunks(count, 1, std::cref(down));
  for (const int p : trunk_.panels) store(panels_[p]);
}

}  // namespace crumple::sim::linear_solver
