#include "server/sim/linear_solver/multigrid_hierarchy.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::linear_solver {
namespace {

constexpr int kCoarsest = 24;      // points: few enough for a dense factor
constexpr double kTooSlow = 0.75;  // a level with more than this share of the finer one's points is not worth its price

}  // namespace

void MultigridHierarchy::rebuild(const LevelGraph& graph, std::span<const Vec3> X, std::span<const char> held,
                                 double mean_tet_volume) {
  levels_.clear();
  held_.assign(held.begin(), held.end());
  CoarseLattice lattice = coarse_lattice(X, mean_tet_volume);
  LevelGraph fine = graph;
  std::vector<Vec3> fine_X(X.begin(), X.end()), coarse_X;
  std::vector<char> fine_held = held_;
  while (static_cast<int>(fine_X.size()) > kCoarsest) {
    Level level;
    level.transfer = make_transfer(fine_X, fine, fine_held, lattice, levels_.empty(), coarse_X);
    if (coarse_X.empty() || static_cast<double>(coarse_X.size()) > kTooSlow * static_cast<double>(fine_X.size())) break;
    level.product = GalerkinProduct(fine, level.transfer, level.A);
    levels_.push_back(std::move(level));
    fine = {levels_.back().A.row_start(), levels_.back().A.columns()};  // of vectors whose storage moves along
    fine_X = coarse_X;
    fine_held.assign(fine_X.size(), 0);
    lattice.spacing *= 2;
  }
}

template <class Scalar>
void MultigridHierarchy::update(const BlockSparseMatrix<Scalar>& A, std::span<const Vec3> X, std::span<const char> held,
                                double mean_tet_volume, const ThreadPool& pool) {
  assert(static_cast<int>(X.size()) == A.rows() && held.size() == X.size());
  if (A.block_count() != block_count_ || !std::ranges::equal(held, held_)) {
    block_count_ = A.block_count();
    rebuild({A.row_start(), A.columns()}, X, held, mean_tet_volume);
  }
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    Level& level = levels_[k];
    if (k == 0) level.product.update(A, level.A, pool);
    else level.product.update(levels_[k - 1].A, level.A, pool);
  }
}

template void MultigridHierarchy::update(const BlockSparseMatrix<float>&, std::span<const Vec3>, std::span<const char>, double,
                                         const ThreadPool&);
template void MultigridHierarchy::update(const BlockSparseMatrix<double>&, std::span<const Vec3>, std::span<const char>, double,
                                         const ThreadPool&);

}  // namespace crumple::sim::linear_solver
