#include "server/sim/fem/implicit_euler.h"

#include <cassert>
#include <cmath>
#include <functional>

namespace crumple::sim::fem {

using linear_solver::SolveOptions;
using linear_solver::SolveReport;

StepOptions step_options(const FemMaterial& material, double dt) {
  StepOptions options;
  options.dt = dt;
  options.solve = {material.cg_tolerance, material.cg_max_iterations};
  return options;
}

SolveReport solve(const SolveOptions& options, const ThreadPool& pool, StepScratch& scratch) {
  const StepSystem& system = scratch.system;
  scratch.preconditioner.assign(system.diagonal());
  scratch.preconditioner.invert(pool);
  scratch.velocity = system.guess;
  const auto apply = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) { system.multiply(in, out, pool); };
  const auto precondition = [&](const Eigen::VectorXd& in, Eigen::VectorXd& out) {
    scratch.preconditioner.apply(in, out, pool);
  };
  const SolveReport report = linear_solver::conjugate_gradient(std::cref(apply), std::cref(precondition), system.b,
                                                               scratch.velocity, options, scratch.cg, pool);
  if (!std::isnan(report.residual)) remove_net_momentum_error(system, scratch.velocity);  // NaN: so is b
  return report;
}

void advance(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt, FemState& state) {
  assert(v_plus.size() == 3 * static_cast<Eigen::Index>(state.x.size()));
  if (state.x.empty()) return;
  Eigen::Map<Eigen::VectorXd>(state.v.front().data(), v_plus.size()) = v_plus;
  Eigen::Map<Eigen::VectorXd>(state.x.front().data(), v_plus.size()) += dt * v_plus;
}

SolveReport implicit_euler_step(const RestBody& rest, const std::vector<Tet>& tets, FemState& state,
                                Eigen::Ref<const Eigen::VectorXd> f_ext, std::span<const PrescribedNode> prescribed,
                                const StepOptions& options, const ThreadPool& pool, StepScratch& scratch) {
  assemble(rest, tets, state, f_ext, options.dt, prescribed, pool, scratch.system);
  const SolveReport report = solve(options.solve, pool, scratch);
  advance(scratch.velocity, options.dt, state);
  plastic_flow(rest, tets, state.x, options.dt, options.creep_dt, pool, state.plastic_strain, scratch.system.elements);
  return report;
}

}  // namespace crumple::sim::fem
