#pragma once

#include "server/sim/islands/composite_multigrid.h"
#include "server/sim/islands/island_system.h"
#include "server/sim/islands/rigid_modes.h"
#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/conjugate_gradient.h"

#include <vector>

namespace crumple::sim::islands {

// What a solve keeps from pass to pass: which preconditioner it is, and what of it does not depend on the rows. Borrows the system
// and the rows of the last refresh().
class IslandPreconditioner {
 public:
  IslandPreconditioner() = default;
  IslandPreconditioner(const IslandSystem& system, linear_solver::SolverKind wanted, const ThreadPool& pool) { assign(system, wanted, pool); }
  void assign(const IslandSystem& system, linear_solver::SolverKind wanted, const ThreadPool& pool);  // keeps its memory

  linear_solver::SolverKind kind() const { return kind_; }
  void refresh(const contact::ContactRows& rows);
  void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z);  // z = M^-1 r; 3 a block

  // Of residuals. Rigid modes and factors are measured as block-Jacobi is: in their own norm a stiff body that moves is large, and
  // what its inside does small beside that.
  linear_solver::SquaredNorm norm() const;
  linear_solver::BlockMap blocks() const;  // of block-Jacobi
  bool near_inverse() const { return kind_ == linear_solver::SolverKind::multigrid; }  // SolveOptions

 private:
  void smooth_around_factors(const Eigen::VectorXd& r, Eigen::VectorXd& z);
  void apply_factors(const Eigen::VectorXd& r, Eigen::VectorXd& z);
  void subtract_product(const Eigen::VectorXd& x, Eigen::VectorXd& r);

  const IslandSystem* system_ = nullptr;
  linear_solver::SolverKind kind_ = linear_solver::SolverKind::jacobi;
  const ThreadPool* pool_ = nullptr;
  const contact::ContactRows* rows_ = nullptr;
  std::vector<Mat3> diagonal_;
  // Each used where it is the kind.
  std::vector<MultigridPart> parts_;
  CompositeMultigrid multigrid_;
  linear_solver::BlockJacobi jacobi_;
  std::vector<ModesPart> modes_parts_;
  RigidModes modes_;
  std::vector<IslandSystem::FactorPart> factors_;
  linear_solver::BlockJacobi smoother_;  // around factors, where there are rows
  Eigen::VectorXd left_, product_, correction_;
};

}  // namespace crumple::sim::islands
