#pragma once

#include "server/sim/islands/composite_island.h"
#include "server/sim/islands/composite_multigrid.h"
#include "server/sim/islands/rigid_modes.h"

#include <algorithm>
#include <span>
#include <vector>

namespace crumple::sim::islands {

// The linear system of an island without its contact rows: matrix, right-hand side and layout. Blocks of three unknowns: nodes
// of its soft bodies in order, then linear and angular velocity of its rigid ones. Borrows what it is made of.
class IslandSystem {
 public:
  IslandSystem(const CompositeIsland& island, std::span<const IslandBody> bodies) { assign(island, bodies); }
  IslandSystem() = default;
  void assign(const CompositeIsland& island, std::span<const IslandBody> bodies);  // keeps its memory

  int blocks() const { return blocks_; }
  std::span<const int> first_block() const { return first_block_; }  // by body, -1 outside the island

  // b, and the velocities before the step in x; 3 a block.
  void fill(Eigen::VectorXd& b, Eigen::VectorXd& x) const;
  // Puts into x what bodies know better than their velocities before the step.
  void start_from(Eigen::VectorXd& x) const;

  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const;  // y = A x
  void multiply(const contact::ContactRows& rows, const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const;  // with them
  // The same, and x . y.
  double multiply_and_dot(const contact::ContactRows& rows, const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const;
  // One a block; two a rigid body. They replace what is there.
  void diagonal(std::vector<Mat3>& diagonal) const;
  void rigid_diagonal(std::vector<Mat3>& diagonal) const;
  void append_to(std::vector<Eigen::Triplet<double>>& entries) const;

  // Which solver `automatic` is; any other stays, unless bodies have not what it needs.
  linear_solver::SolverKind choose(linear_solver::SolverKind wanted) const;
  linear_solver::SolverKind choose_without_factors() const;  // which one `automatic` is then
  // What a multigrid cycle works on; brings the bodies' coarse levels up to date.
  void update_coarse_levels(std::vector<MultigridPart>& parts, const ThreadPool& pool) const;
  void modes_parts(std::vector<ModesPart>& parts) const;
  // Each soft body's factor at rest with its first block, up to date; nothing if one cannot be made.
  struct FactorPart {
    fem::WarpedFactor* factor = nullptr;
    int first_block = 0, blocks = 0;
  };
  void update_factors(std::vector<FactorPart>& parts, const ThreadPool& pool) const;

  double spectral_bound() const;  // no eigenvalue of A is above so many times its block diagonal's
  double mass() const;          // of all of it, as the rows of A have it [kg]
  bool anything_fixed() const;  // a prescribed node, or an active row to something that does not move
  // Adds the one velocity that makes the sum of all equations of motion hold. Elastic and contact terms of a free island
  // sum to zero, and see nothing of a common velocity: the rows' impulses stay what they are.
  void remove_net_momentum_error(Eigen::VectorXd& x, const Eigen::VectorXd& b) const;

 private:
  // Whether every soft body has it.
  bool all_have(auto IslandBody::* what) const {
    return std::ranges::all_of(island_->soft, [&](int body) { return bodies_[body].*what != nullptr; });
  }
  void multiply_blocks(int begin, int end, const Eigen::VectorXd& x, Eigen::VectorXd& y) const;
  void append_rigid_diagonal(std::vector<Mat3>& diagonal) const;
  double stiffness() const;  // of soft bodies: the diagonal of A over the mass in it [-]

  const CompositeIsland* island_ = nullptr;
  std::span<const IslandBody> bodies_;
  std::vector<int> first_block_;
  int blocks_ = 0, soft_blocks_ = 0;  // those of soft bodies come first
  mutable std::vector<double> partial_sums_;  // scratch of multiply_and_dot(), one a chunk
};

// Whether a body's factor is worth making with the world, for the steps in which nothing touches it: `automatic` takes it then.
// body: its system assembled.
bool is_worth_a_factor(const IslandBody& body);

}  // namespace crumple::sim::islands
