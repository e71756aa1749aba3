#include "server/sim/islands/island_preconditioner.h"

#include <functional>

namespace crumple::sim::islands {

using contact::ContactRows;
using Eigen::VectorXd;
using linear_solver::SolverKind;

namespace {

constexpr double kRelaxation = 1.5;  // of a smoothing step whose largest eigenvalue is known to be at most one; below two

}  // namespace

void IslandPreconditioner::assign(const IslandSystem& system, SolverKind wanted, const ThreadPool& pool) {
  system_ = &system;
  pool_ = &pool;
  kind_ = system.choose(wanted);
  if (kind_ == SolverKind::warped_factor) {
    system.update_factors(factors_, pool);
    if (factors_.empty()) kind_ = system.choose_without_factors();
  }
  if (kind_ == SolverKind::multigrid) system.update_coarse_levels(parts_, pool);
  if (kind_ != SolverKind::rigid_modes) return;
  const auto multiply = [&](const VectorXd& in, VectorXd& out) { system.multiply(in, out, pool); };
  system.modes_parts(modes_parts_);
  system.rigid_diagonal(diagonal_);
  modes_.assign(modes_parts_, diagonal_, std::cref(multiply));
}

void IslandPreconditioner::refresh(const ContactRows& rows) {
  rows_ = &rows;
  if (kind_ == SolverKind::multigrid) {
    system_->rigid_diagonal(diagonal_);
    multigrid_.assign(parts_, diagonal_, rows, *pool_);
    return;
  }
  system_->diagonal(diagonal_);
  jacobi_.assign(diagonal_);
  rows.add_to_diagonal(jacobi_.blocks(), *pool_);
  jacobi_.invert(*pool_);
  if (kind_ == SolverKind::rigid_modes) modes_.factor(rows);
  if (kind_ != SolverKind::warped_factor || rows.size() == 0) return;
  // A <= high D and W^T D_rows W <= high bound: no eigenvalue of the scaled blocks times the matrix is above one.
  const double high = system_->spectral_bound();
  smoother_.assign(diagonal_);
  LevelRows(rows).add_bound(1 / high, smoother_.blocks());
  for (Mat3& block : smoother_.blocks()) block *= high / kRelaxation;
  smoother_.invert(*pool_);
}

void IslandPreconditioner::apply(const VectorXd& r, VectorXd& z) {
  if (kind_ == SolverKind::multigrid) return multigrid_.apply(r, z);
  if (kind_ == SolverKind::warped_factor) {
    if (rows_->size() == 0) return apply_factors(r, z);
    return smooth_around_factors(r, z);
  }
  jacobi_.apply(r, z, *pool_);
  if (kind_ == SolverKind::rigid_modes) modes_.add_to(r, z);
}

void IslandPreconditioner::apply_factors(const VectorXd& r, VectorXd& z) {
  const IslandSystem::FactorPart& last = factors_.back();
  if (last.first_block + last.blocks < system_->blocks()) jacobi_.apply(r, z, *pool_);  // rigid bodies, which come last
  const auto job = [&](int k) {
    const IslandSystem::FactorPart& part = factors_[k];
    part.factor->apply(r.segment(3 * part.first_block, 3 * part.blocks), z.segment(3 * part.first_block, 3 * part.blocks), *pool_);
  };
  pool_->for_jobs(static_cast<int>(factors_.size()), std::cref(job));
}

void IslandPreconditioner::subtract_product(const VectorXd& x, VectorXd& r) {
  product_.resize(x.size());
  system_->multiply(*rows_, x, product_, *pool_);
  r -= product_;
}

// Factors do not know of rows. What these leave is smoothed before and after, which keeps the whole symmetric positive definite.
void IslandPreconditioner::smooth_around_factors(const VectorXd& r, VectorXd& z) {
  left_ = r;
  correction_.resize(r.size());
  smoother_.apply(r, z, *pool_);
  subtract_product(z, left_);
  apply_factors(left_, correction_);
  z += correction_;
  subtract_product(correction_, left_);
  smoother_.apply(left_, correction_, *pool_);
  z += correction_;
}

linear_solver::BlockMap IslandPreconditioner::blocks() const {
  if (kind_ != SolverKind::jacobi) return {};
  return [this](int begin, int end, const VectorXd& r, VectorXd& z) { jacobi_.apply_blocks(begin, end, r.data(), z.data()); };
}

linear_solver::SquaredNorm IslandPreconditioner::norm() const {
  if (kind_ != SolverKind::rigid_modes && kind_ != SolverKind::warped_factor) return {};
  return [this](const VectorXd& r) { return jacobi_.squared_norm(r, *pool_); };
}

}  // namespace crumple::sim::islands
