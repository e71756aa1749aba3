#pragma once

#include "server/sim/islands/composite_multigrid.h"
#include "server/sim/islands/island_system.h"
#include "server/sim/islands/rigid_modes.h"
#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/conjugate_gradient.h"

#include <optional>
#include <vector>

namespace crumple::sim::islands {

// What a solve keeps from pass to pass: which preconditioner it is, and what of it does not depend on the rows. Borrows the system
// and the rows of the last refresh().
class IslandPreconditioner {
 public:
  IslandPreconditioner(const IslandSystem& system, linear_solver::SolverKind wanted, const ThreadPool& pool);

  linear_solver::SolverKind kind() const { return kind_; }
  void refresh(const contact::ContactRows& rows);
  void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z);  // z = M^-1 r; 3 a block

  // Of residuals. Rigid modes and factors are measured as block-Jacobi is: in their own norm a stiff body that moves is large, and
  // what its inside does small beside that.
  linear_solver::SquaredNorm norm() const;
  bool near_inverse() const { return kind_ == linear_solver::SolverKind::multigrid; }  // SolveOptions

 private:
  void smooth_around_factors(const Eigen::VectorXd& r, Eigen::VectorXd& z);
  void apply_factors(const Eigen::VectorXd& r, Eigen::VectorXd& z);
  void subtract_product(const Eigen::VectorXd& x, Eigen::VectorXd& r);

  const IslandSystem& system_;
  linear_solver::SolverKind kind_;
  const ThreadPool& pool_;
  const contact::ContactRows* rows_ = nullptr;
  std::vector<MultigridPart> parts_;
  std::optional<CompositeMultigrid> multigrid_;
  linear_solver::BlockJacobi jacobi_;
  std::optional<RigidModes> modes_;
  std::vector<IslandSystem::FactorPart> factors_;
  linear_solver::BlockJacobi smoother_;  // around factors, where there are rows
  Eigen::VectorXd left_, product_, correction_;
};

}  // namespace crumple::sim::islands
