#include "server/sim/linear_solver/multigrid_hierarchy.h"

#include <algorithm>
#include <cassert>
#include <type_traits>
#include <utility>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kBlocksPerChunk = 4096;
constexpr int kCoarsest = 24;      // points: few enough for a dense factor
constexpr double kTooSlow = 0.75;  // a level with more than this share of the finer one's points is not worth its price

}  // namespace

void MultigridHierarchy::follow(const std::shared_ptr<const BlockPattern>& pattern, std::span<const Vec3> X, std::span<const char> held,
                                double mean_tet_volume) {
  const std::vector<Level> before = std::exchange(levels_, {});
  LevelGraph fine_of_before;
  if (pattern_) fine_of_before = {pattern_->row_start, pattern_->columns};
  std::vector<int> fine_before;  // which one each point was
  if (!before.empty()) fine_before = match_points(X_, X);
  CoarseLattice lattice = coarse_lattice(X, mean_tet_volume);
  LevelGraph fine{pattern->row_start, pattern->columns};
  std::vector<Vec3> fine_X(X.begin(), X.end()), coarse_X;
  std::vector<char> fine_held(held.begin(), held.end());
  while (static_cast<int>(fine_X.size()) > kCoarsest) {
    Level level;
    level.transfer = make_transfer(fine_X, fine, fine_held, lattice, levels_.empty(), coarse_X);
    if (coarse_X.empty() || static_cast<double>(coarse_X.size()) > kTooSlow * static_cast<double>(fine_X.size())) break;
    if (levels_.size() < before.size()) {
      const Level& old = before[levels_.size()];
      const LevelView was{fine_of_before, old.transfer};
      LevelChange change = level_change(was, {fine, level.transfer}, std::move(fine_before));
      level.product = GalerkinProduct(fine, level.transfer, {old.product, was, old.A, change}, level.A);
      fine_of_before = {old.A.row_start(), old.A.columns()};
      fine_before = std::move(change.coarse_before);
    } else {
      level.product = GalerkinProduct(fine, level.transfer, level.A);
    }
    levels_.push_back(std::move(level));
    fine = {levels_.back().A.row_start(), levels_.back().A.columns()};  // of a pattern that the level shares
    fine_X = coarse_X;
    fine_held.assign(fine_X.size(), 0);
    lattice.spacing *= 2;
  }
  held_.assign(held.begin(), held.end());
  X_.assign(X.begin(), X.end());
  pattern_ = pattern;
}

template <class Scalar>
void MultigridHierarchy::update(const BlockSparseMatrix<Scalar>& A, std::span<const Vec3> X, std::span<const char> held,
                                double mean_tet_volume, const ThreadPool& pool) {
  assert(static_cast<int>(X.size()) == A.rows() && held.size() == X.size());
  const bool same = pattern_ && (A.pattern() == pattern_ || *A.pattern() == *pattern_);
  if (same) pattern_ = A.pattern();
  if (!same || !std::ranges::equal(held, held_)) follow(A.pattern(), X, held, mean_tet_volume);
  if constexpr (std::is_same_v<Scalar, float>) {
    values_ = A.values();
  } else {
    finest_.resize(9 * static_cast<std::size_t>(A.block_count()) + 1);
    pool.for_chunks(A.block_count(), kBlocksPerChunk, [&](int begin, int end) {
      std::transform(A.values() + 9 * begin, A.values() + 9 * end, finest_.begin() + 9 * begin, [](Scalar s) { return static_cast<float>(s); });
    });
    values_ = finest_.data();
  }
  const float* values = values_;
  std::span<const Mat3> diagonal = A.diagonal();
  for (Level& level : levels_) {
    level.product.update(values, diagonal, level.A, pool);
    values = level.A.values();
    diagonal = level.A.diagonal();
  }
}

template void MultigridHierarchy::update(const BlockSparseMatrix<float>&, std::span<const Vec3>, std::span<const char>, double,
                                         const ThreadPool&);
template void MultigridHierarchy::update(const BlockSparseMatrix<double>&, std::span<const Vec3>, std::span<const char>, double,
                                         const ThreadPool&);

}  // namespace crumple::sim::linear_solver
