#include "server/sim/linear_solver/galerkin_product.h"

#include "server/sim/linear_solver/lanes.h"

#include <algorithm>
#include <cstring>
#include <functional>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kRowsPerChunk = 16;  // coarse rows: each gathers a few dozen fine ones

// Weighted sum of 3x3 blocks, nine numbers each by columns.
struct BlockSum {
  Octet first{};
  float last = 0;

  void add(const float* block, float weight) {
    first = multiply_add(load_octet(block), octet(weight), first);
    last += weight * block[8];
  }
  void add(const Mat3& block, float weight) {
    const Eigen::Matrix3f single = block.cast<float>();
    add(single.data(), weight);
  }
  Eigen::Matrix3f matrix() const {
    Eigen::Matrix3f m;
    std::memcpy(m.data(), &first, sizeof first);
    m(2, 2) = last;
    return m;
  }
};

// visit(j, block, w_i): for each fine i that I moves by w_i, and each block (i, j) of its row; -1 - i: the diagonal's.
template <class Visit>
void each_fine_block(const LevelGraph& fine, const LevelTransfer& t, int I, const Visit& visit) {
  for (int c = t.column_start[I]; c < t.column_start[I + 1]; ++c) {
    const int i = t.fine[c];
    visit(i, -1 - i, t.column_weight[c]);
    for (int k = fine.row_start[i]; k < fine.row_start[i + 1]; ++k) visit(fine.columns[k], k, t.column_weight[c]);
  }
}

// Ids of the fine blocks of before, in rows that are as long as they were.
std::vector<int> blocks_after(const LevelGraph& before, const LevelGraph& now, std::span<const int> fine_before) {
  std::vector<int> after(before.columns.size(), -1);
  for (std::size_t i = 0; i < fine_before.size(); ++i) {
    const int was = fine_before[i], size = now.row_start[i + 1] - now.row_start[i];
    if (was < 0 || before.row_start[was + 1] - before.row_start[was] != size) continue;
    for (int k = 0; k < size; ++k) after[before.row_start[was] + k] = now.row_start[i] + k;
  }
  return after;
}

}  // namespace

GalerkinProduct::GalerkinProduct(const LevelGraph& fine, const LevelTransfer& t, BlockSparseMatrix<float>& A_c) {
  find_pattern(fine, t, nullptr, A_c);
  find_terms(fine, t, nullptr, A_c);
}

GalerkinProduct::GalerkinProduct(const LevelGraph& fine, const LevelTransfer& t, const Before& before, BlockSparseMatrix<float>& A_c) {
  find_pattern(fine, t, &before, A_c);
  find_terms(fine, t, &before, A_c);
}

// The neighbours of a coarse row, by the fine rows that it moves and theirs.
void GalerkinProduct::find_pattern(const LevelGraph& fine, const LevelTransfer& t, const Before* before,
                                   BlockSparseMatrix<float>& A_c) const {
  std::vector<int> row_start{0}, columns;
  std::vector<int> seen(t.coarse_count(), -1);
  for (int I = 0; I < t.coarse_count(); ++I) {
    const auto begin = static_cast<std::ptrdiff_t>(columns.size());
    if (before && before->change.same[I]) {
      const int was = before->change.coarse_before[I];
      const std::span<const int> starts = before->A_c.row_start();
      for (const int J : before->A_c.columns().subspan(starts[was], starts[was + 1] - starts[was]))
        columns.push_back(before->change.coarse_after[J]);
    } else {
      seen[I] = I;
      each_fine_block(fine, t, I, [&](int j, int, float) {
        for (int b = t.row_start[j]; b < t.row_start[j + 1]; ++b) {
          const int J = t.coarse[b];
          if (seen[J] == I) continue;
          seen[J] = I;
          columns.push_back(J);
        }
      });
      std::sort(columns.begin() + begin, columns.end());
    }
    row_start.push_back(static_cast<int>(columns.size()));
  }
  if (!before) columns.shrink_to_fit();  // kept for long
  A_c = BlockSparseMatrix<float>::from_pattern(std::move(row_start), std::move(columns));
}

// Counted and then filled, block by block.
void GalerkinProduct::find_terms(const LevelGraph& fine, const LevelTransfer& t, const Before* before,
                                 const BlockSparseMatrix<float>& A_c) {
  std::vector<int> fine_after;  // of fine blocks of before
  if (before) fine_after = blocks_after(before->level.fine, fine, before->change.fine_before);
  std::vector<int> point_after(before ? before->level.transfer.fine_count() : 0, -1);
  for (std::size_t i = 0; before && i < before->change.fine_before.size(); ++i)
    if (const int was = before->change.fine_before[i]; was >= 0) point_after[was] = static_cast<int>(i);
  const auto columns = A_c.columns();
  const auto starts = A_c.row_start();
  row_start_.push_back(0);
  if (before) terms_.reserve(before->product.terms_.size() + before->product.terms_.size() / 8);
  std::vector<int> slot(t.coarse_count(), -1);  // of a coarse column in this row: 0 the diagonal, then uppers
  std::vector<int> count;
  for (int I = 0; I < t.coarse_count(); ++I) {
    const auto first_upper = static_cast<int>(uppers_.size());
    slot[I] = 0;
    for (int k = starts[I]; k < starts[I + 1]; ++k) {
      if (columns[k] < I) {
        slot[columns[k]] = -1;
        continue;
      }
      uppers_.push_back({k, A_c.find(columns[k], I)});
      slot[columns[k]] = static_cast<int>(uppers_.size()) - first_upper;
    }
    row_start_.push_back(static_cast<int>(uppers_.size()));
    const auto base = static_cast<int>(terms_.size());
    if (before && before->change.same[I]) {
      const GalerkinProduct& old = before->product;
      const int was = before->change.coarse_before[I];
      const int first = old.row_start_[was] + was, last = old.row_start_[was + 1] + was + 1;  // into its term_start_
      const int shift = base - old.term_start_[first];
      for (int k = first; k < last; ++k) term_start_.push_back(old.term_start_[k] + shift);
      for (int k = old.term_start_[first]; k < old.term_start_[last]; ++k) {
        const Term& term = old.terms_[k];
        terms_.push_back({term.fine >= 0 ? fine_after[term.fine] : -1 - point_after[-1 - term.fine], term.weight});
      }
      continue;
    }
    count.assign(uppers_.size() - first_upper + 2, 0);
    const auto each_term = [&](const auto& visit) {
      each_fine_block(fine, t, I, [&](int j, int block, float w_i) {
        for (int b = t.row_start[j]; b < t.row_start[j + 1]; ++b) {
          const int J = t.coarse[b];
          if (J < I) continue;
          visit(slot[J], Term{block, w_i * t.weight[b]});
        }
      });
    };
    each_term([&](int s, const Term&) { ++count[s + 1]; });
    for (std::size_t s = 1; s < count.size(); ++s) count[s] += count[s - 1];
    terms_.resize(base + count.back());
    for (std::size_t s = 0; s + 1 < count.size(); ++s) term_start_.push_back(base + count[s]);
    each_term([&](int s, const Term& term) { terms_[base + count[s]++] = term; });
  }
  term_start_.push_back(static_cast<int>(terms_.size()));
  if (!before) terms_.shrink_to_fit();  // kept for long
}

void GalerkinProduct::update(const float* values, std::span<const Mat3> diagonal, BlockSparseMatrix<float>& A_c, const ThreadPool& pool) const {
  const auto sum = [&](int coarse_block) {
    BlockSum of_even, of_odd;  // two, since one addition waits for the one before
    const auto add = [&](const Term& term, BlockSum& to) {
      if (term.fine >= 0) to.add(values + 9 * static_cast<std::ptrdiff_t>(term.fine), term.weight);
      else to.add(diagonal[-1 - term.fine], term.weight);
    };
    const int end = term_start_[coarse_block + 1];
    int k = term_start_[coarse_block];
    for (; k + 1 < end; k += 2) {
      add(terms_[k], of_even);
      add(terms_[k + 1], of_odd);
    }
    if (k < end) add(terms_[k], of_even);
    return (of_even.matrix() + of_odd.matrix()).eval();
  };
  const auto rows = [&](int begin, int end) {
    for (int I = begin; I < end; ++I) {
      const Eigen::Matrix3f D = sum(row_start_[I] + I);
      A_c.diagonal()[I] = (0.5f * (D + D.transpose())).cast<double>();
      for (int u = row_start_[I]; u < row_start_[I + 1]; ++u) {
        const Eigen::Matrix3f B = sum(u + I + 1);
        A_c.set_block(uppers_[u].block, B);
        A_c.set_block(uppers_[u].mirror, B.transpose());
      }
    }
  };
  pool.for_chunks(A_c.rows(), kRowsPerChunk, std::cref(rows));
}

}  // namespace crumple::sim::linear_solver
