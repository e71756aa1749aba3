#include "server/sim/linear_solver/galerkin_product.h"

#include "server/sim/linear_solver/lanes.h"

#include <algorithm>
#include <functional>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kRowsPerChunk = 64;  // coarse rows: each gathers a few dozen fine ones

template <class Scalar>
LaneBlock load_block(const Scalar* p) {
  LaneBlock B;
  for (int j = 0; j < 3; ++j) B.column[j] = load_lanes(p + 3 * j);
  return B;
}

void add_scaled(const LaneBlock& B, float weight, LaneBlock& sum) {
  for (int j = 0; j < 3; ++j) sum.column[j] = multiply_add(B.column[j], lanes(weight), sum.column[j]);
}

Eigen::Matrix3f to_matrix(const LaneBlock& B) {
  Eigen::Matrix3f m;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) m(i, j) = B.column[j][i];
  return m;
}

}  // namespace

GalerkinProduct::GalerkinProduct(const LevelGraph& fine, const LevelTransfer& t, BlockSparseMatrix<float>& A_c) {
  const int coarse_count = t.coarse_count();
  // Pattern: the neighbours of a coarse row, by the fine rows that it moves and theirs.
  std::vector<int> pattern_start{0}, pattern;
  std::vector<int> seen(coarse_count, -1);
  // visit(j, block, w_i): for each fine i that I moves by w_i, and each block (i, j) of its row.
  const auto each_fine_block = [&](int I, const auto& visit) {
    for (int c = t.column_start[I]; c < t.column_start[I + 1]; ++c) {
      const int i = t.fine[c];
      visit(i, -1 - i, t.column_weight[c]);
      for (int k = fine.row_start[i]; k < fine.row_start[i + 1]; ++k) visit(fine.columns[k], k, t.column_weight[c]);
    }
  };
  for (int I = 0; I < coarse_count; ++I) {
    const auto begin = static_cast<std::ptrdiff_t>(pattern.size());
    seen[I] = I;
    each_fine_block(I, [&](int j, int, float) {
      for (int b = t.row_start[j]; b < t.row_start[j + 1]; ++b) {
        const int J = t.coarse[b];
        if (seen[J] == I) continue;
        seen[J] = I;
        pattern.push_back(J);
      }
    });
    std::sort(pattern.begin() + begin, pattern.end());
    pattern_start.push_back(static_cast<int>(pattern.size()));
  }
  A_c = BlockSparseMatrix<float>::from_pattern(std::move(pattern_start), std::move(pattern));

  // Terms, counted and then filled, block by block.
  const auto columns = A_c.columns();
  const auto starts = A_c.row_start();
  row_start_.push_back(0);
  std::vector<int> slot(coarse_count, -1);  // of a coarse column in this row: 0 the diagonal, then uppers
  std::vector<int> count;
  for (int I = 0; I < coarse_count; ++I) {
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

    count.assign(uppers_.size() - first_upper + 2, 0);
    const auto each_term = [&](const auto& visit) {
      each_fine_block(I, [&](int j, int block, float w_i) {
        for (int b = t.row_start[j]; b < t.row_start[j + 1]; ++b) {
          const int J = t.coarse[b];
          if (J < I) continue;
          visit(slot[J], Term{block, w_i * t.weight[b]});
        }
      });
    };
    each_term([&](int s, const Term&) { ++count[s + 1]; });
    const auto base = static_cast<int>(terms_.size());
    for (std::size_t s = 1; s < count.size(); ++s) count[s] += count[s - 1];
    terms_.resize(base + count.back());
    for (std::size_t s = 0; s + 1 < count.size(); ++s) term_start_.push_back(base + count[s]);
    each_term([&](int s, const Term& term) { terms_[base + count[s]++] = term; });
  }
  term_start_.push_back(static_cast<int>(terms_.size()));
}

template <class Scalar>
void GalerkinProduct::update(const BlockSparseMatrix<Scalar>& A, BlockSparseMatrix<float>& A_c, const ThreadPool& pool) const {
  const Scalar* values = A.values();
  const auto sum = [&](int coarse_block) {
    LaneBlock block;
    for (int k = term_start_[coarse_block]; k < term_start_[coarse_block + 1]; ++k) {
      const Term& term = terms_[k];
      add_scaled(term.fine >= 0 ? load_block(values + 9 * static_cast<std::ptrdiff_t>(term.fine)) : LaneBlock(A.diagonal()[-1 - term.fine]),
                 term.weight, block);
    }
    return to_matrix(block);
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

template void GalerkinProduct::update(const BlockSparseMatrix<float>&, BlockSparseMatrix<float>&, const ThreadPool&) const;
template void GalerkinProduct::update(const BlockSparseMatrix<double>&, BlockSparseMatrix<float>&, const ThreadPool&) const;

}  // namespace crumple::sim::linear_solver
