#pragma once

#include "server/sim/fem/assembly.h"
#include "server/sim/islands/level_rows.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"

#include <Eigen/Cholesky>

#include <span>
#include <vector>

namespace crumple::sim::islands {

// A soft body in an island's system: its matrix, its coarse levels, and its first block of three unknowns.
struct MultigridPart {
  const fem::StepSystem* system = nullptr;
  const linear_solver::MultigridHierarchy* hierarchy = nullptr;
  int first_block = 0;
};

// Preconditioner of a composite island: one V-cycle over the coarse levels of its bodies, contact rows and rigid bodies
// on every level. Symmetric and positive definite: smoothed before and after by the same Chebyshev polynomial in the block
// diagonal. The polynomial's interval is a constant of what the bodies are made of (StepSystem::spectral_bound). On the finest
// level that is proved to be enough for tets: a matrix assembled from elements of k nodes has no eigenvalue above k of its block
// diagonal's, and contact rows enter the diagonal by a bound of their own. On coarse levels, whose "elements" touch more points, it is what meshes were measured to stay below (tested).
// Single precision inside; bits do not depend on the number of threads. Borrows: hierarchies stay as they are while it is used.
class CompositeMultigrid {
 public:
  // parts: in the order of their blocks, which they fill without gaps. rigid: diagonal blocks of rigid bodies, after the
  // parts'. rows: of the same unknowns.
  CompositeMultigrid(std::span<const MultigridPart> parts, std::span<const Mat3> rigid, const contact::ContactRows& rows,
                     const ThreadPool& pool) {
    assign(parts, rigid, rows, pool);
  }
  CompositeMultigrid() = default;
  void assign(std::span<const MultigridPart> parts, std::span<const Mat3> rigid, const contact::ContactRows& rows,
              const ThreadPool& pool);  // keeps its memory

  // z = M^-1 r; r, z: 3 a block.
  void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z);

  int level_count() const { return level_count_; }

 private:
  struct LevelPart {
    explicit LevelPart(const MultigridPart& part);
    void follow(const linear_solver::MultigridHierarchy::Level& level);  // from the next finer level

    Lanes product(int i, const Lanes* x) const;  // off-diagonal part of row i times x, both the part's own

    // The part's matrix: pattern, off-diagonal and diagonal blocks.
    std::span<const int> row_start, columns;
    const float* values;
    std::span<const Mat3> diagonal;
    const linear_solver::LevelTransfer* transfer = nullptr;  // to the next coarser level; null: the same points there
    int first = 0, count = 0, coarse_first = 0;
  };
  struct Level {
    int blocks = 0, rigid_first = 0, coarse_rigid_first = 0;
    std::vector<LevelPart> parts;
    LevelRows rows;
    std::vector<LaneBlock> diagonal, smoother;  // of A; of the polynomial: inverse
    std::vector<Lanes> b, x, next, d;
  };

  void make_coarser_level(Level& fine, Level& coarse);
  void prepare(Level& level);
  void factor_coarsest();
  void solve_coarsest(Level& level);
  template <class Finish>
  void each_row(Level& level, const Finish& finish) const;
  void smooth(Level& level, int steps, double low, bool from_zero) const;
  void cycle(std::size_t l);

  const ThreadPool* pool_ = nullptr;
  std::vector<Mat3> rigid_;
  std::vector<Level> levels_;  // the first level_count_ of them
  int level_count_ = 0;
  std::vector<Mat3> bound_;    // scratch: a level's block diagonal with its rows' bound
  Eigen::MatrixXd dense_A_;
  double high_ = 0;  // upper end of the polynomial's interval
  bool dense_ = false;
  Eigen::LLT<Eigen::MatrixXd> coarsest_;
  Eigen::VectorXd dense_b_;
};

}  // namespace crumple::sim::islands
