#pragma once

#include "server/sim/linear_solver/block_sparse_matrix.h"
#include "server/sim/linear_solver/level_change.h"

namespace crumple::sim::linear_solver {

// A_c = P^T A P of one level: the pattern is found once, the values are gathered in every step. Each coarse block is one
// thread's, its terms in a fixed order: the bits do not depend on the number of threads.
class GalerkinProduct {
 public:
  GalerkinProduct() = default;
  // fine: pattern of A. A_c gets its pattern here, values by update.
  GalerkinProduct(const LevelGraph& fine, const LevelTransfer& transfer, BlockSparseMatrix<float>& A_c);
  // The same product, taking over the rows that a change of topology left as they were: its cost is that of a copy, and of what
  // is near the change.
  struct Before {
    const GalerkinProduct& product;
    LevelView level;
    const BlockSparseMatrix<float>& A_c;
    const LevelChange& change;
  };
  GalerkinProduct(const LevelGraph& fine, const LevelTransfer& transfer, const Before& before, BlockSparseMatrix<float>& A_c);

  friend bool operator==(const GalerkinProduct&, const GalerkinProduct&) = default;

  // values: off-diagonal blocks of A, 9 numbers each and one more; diagonal: its others.
  void update(const float* values, std::span<const Mat3> diagonal, BlockSparseMatrix<float>& A_c, const ThreadPool& pool) const;

 private:
  struct Term {
    int fine;      // off-diagonal block of A; -1 - i: diagonal block i
    float weight;
    bool operator==(const Term&) const = default;
  };
  // Of a coarse row: its diagonal block, then its off-diagonal blocks right of the diagonal. Those left of it are the
  // transposes of others.
  struct Upper {
    int block, mirror;  // of A_c
    bool operator==(const Upper&) const = default;
  };
  void find_pattern(const LevelGraph& fine, const LevelTransfer& transfer, const Before* before, BlockSparseMatrix<float>& A_c) const;
  void find_terms(const LevelGraph& fine, const LevelTransfer& transfer, const Before* before, const BlockSparseMatrix<float>& A_c);
  std::vector<int> row_start_;   // coarse rows + 1, into uppers_
  std::vector<Upper> uppers_;
  std::vector<int> term_start_;  // into terms_: of row I's diagonal block at row_start_[I] + I, its uppers after it; and
                                 // one more
  std::vector<Term> terms_;
};

}  // namespace crumple::sim::linear_solver
