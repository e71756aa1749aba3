#pragma once

#include "server/sim/fem/assembly.h"
#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/conjugate_gradient.h"

namespace crumple::sim::fem {

struct StepOptions {
  double dt = 1.0 / 60;        // [s]
  double creep_dt = 1.0 / 60;  // dt_ref of creep [s]
  linear_solver::SolveOptions solve;
};

// dt, and the solver's tolerance and cap as the material says.
StepOptions step_options(const FemMaterial& material, double dt);

// Everything a step of one body works in; sized at the first step and when the topology changes.
struct StepScratch {
  explicit StepScratch(bool float_matrix = false) : system(float_matrix) {}

  StepSystem system;
  linear_solver::BlockJacobi preconditioner;
  linear_solver::CgWorkspace cg;
  Eigen::VectorXd velocity;  // v+, 3n
};

// v+ of the assembled scratch.system by block-Jacobi conjugate gradients from system.guess, into scratch.velocity, net
// momentum error removed. The result is finite if the guess was.
linear_solver::SolveReport solve(const linear_solver::SolveOptions& options, const ThreadPool& pool,
                                 StepScratch& scratch);

// v := v+, x := x + dt v+ (after eq. 4). v_plus: 3n.
void advance(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt, FemState& state);

// One step of a single body without contact: assemble, solve, advance, plastic flow. f_ext: 3n [N]. Afterwards
// scratch.system.elements holds Q and sigma at the new positions if the material yields, at the old ones if not.
linear_solver::SolveReport implicit_euler_step(const RestBody& rest, const std::vector<Tet>& tets, FemState& state,
                                               Eigen::Ref<const Eigen::VectorXd> f_ext,
                                               std::span<const PrescribedNode> prescribed, const StepOptions& options,
                                               const ThreadPool& pool, StepScratch& scratch);

}  // namespace crumple::sim::fem
