#include "server/lab/stability/soft_integrators.h"

#include "server/sim/fem/plasticity.h"
#include "server/sim/islands/composite_island.h"
#include "server/sim/linear_solver/cholesky.h"

#include <Eigen/SVD>

#include <numeric>

namespace crumple::lab::stability {

using namespace sim::fem;
using sim::linear_solver::Cholesky;
using sim::linear_solver::SolveReport;
using sim::linear_solver::SolverKind;

namespace {

constexpr double kCreepDt = 1.0 / 60;  // the scene's default [s]

void set_prescribed(SoftTrial& trial) {
  for (const PrescribedNode& node : trial.prescribed) trial.state.v[node.node] = node.velocity;
}

}  // namespace

SolveReport backward_euler(SoftTrial& trial, double dt) {
  return implicit_euler_step(trial.rest, trial.mesh.tets, trial.state, trial.force, trial.prescribed,
                             step_options(trial.rest.material, dt), trial.pool, trial.scratch);
}

SolveReport bdf2(SoftTrial& trial, double dt) {
  return bdf2_step(trial.rest, trial.mesh.tets, trial.state, trial.force, trial.prescribed,
                   step_options(trial.rest.material, dt), trial.pool, trial.scratch, trial.bdf2_scratch);
}

namespace {

SolveReport step_as_island(SoftTrial& trial, double dt, SolverKind solver) {
  StepSystem& system = trial.scratch.system;
  const RestBody& rest = trial.rest;
  assemble(rest, trial.mesh.tets, trial.state, trial.force, dt, trial.prescribed, trial.pool, system);
  const double volume = std::accumulate(rest.volume.begin(), rest.volume.end(), 0.0);
  const std::vector<sim::islands::IslandBody> bodies{{.system = &system,
                                                      .hierarchy = &trial.hierarchy,
                                                      .x = &trial.state.x,
                                                      .X = &trial.mesh.X,
                                                      .mean_tet_volume = volume / trial.mesh.tet_count()}};
  sim::islands::CompositeIsland island{.soft = {0}};
  const auto solution = sim::islands::solve(
      island, bodies, {.solve = step_options(rest.material, dt).solve, .solver = solver}, {}, trial.pool);
  advance(solution.soft_velocity(0), dt, trial.state);
  plastic_flow(rest, trial.mesh.tets, trial.state.x, dt, kCreepDt, trial.pool, trial.state.plastic_strain,
               system.elements);
  return solution.report;
}

}  // namespace

SolveReport backward_euler_multigrid(SoftTrial& trial, double dt) {
  return step_as_island(trial, dt, SolverKind::multigrid);
}

SolveReport backward_euler_direct(SoftTrial& trial, double dt) { return step_as_island(trial, dt, SolverKind::direct); }

SolveReport backward_euler_any_rotation(SoftTrial& trial, double dt) {
  const RestBody& rest = trial.rest;
  const int n = trial.mesh.node_count();
  std::vector<char> struck(n, 0);
  set_prescribed(trial);
  for (const PrescribedNode& node : trial.prescribed) struck[node.node] = 1;

  const double stiffness = dt * rest.material.damping_stiffness + dt * dt,
               inertia = 1 + dt * rest.material.damping_mass;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b = dt * trial.force;
  for (int i = 0; i < n; ++i) {
    b.segment<3>(3 * i) += rest.node_mass[i] * trial.state.v[i];
    for (int c = 0; c < 3; ++c)
      entries.emplace_back(3 * i + c, 3 * i + c, (struck[i] ? 1 : inertia) * rest.node_mass[i]);
  }
  for (int t = 0; t < trial.mesh.tet_count(); ++t) {
    const RestTet tet = rest.tet(t);
    const Tet& nodes = trial.mesh.tets[t];
    const Mat34 x = gather(trial.state.x, nodes);
    const Mat3 Q = trial.method.rotation(deformation_gradient(x, tet.beta));
    const Mat3 strain = element_strain(rest, t, x, Q) - trial.state.plastic_strain[t];
    const Mat34 f = nodal_forces(tet, Q, isotropic_stress(rest.lame, strain));
    for (int i = 0; i < 4; ++i) {
      b.segment<3>(3 * nodes[i]) += dt * f.col(i);
      for (int j = 0; j < 4; ++j) {
        const Mat3 K = stiffness * stiffness_block(tet, rest.lame, Q, i, j);
        if (struck[nodes[j]]) {
          b.segment<3>(3 * nodes[i]) -= K * trial.state.v[nodes[j]];
          continue;
        }
        if (struck[nodes[i]]) continue;
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) entries.emplace_back(3 * nodes[i] + r, 3 * nodes[j] + c, K(r, c));
      }
    }
  }
  for (const PrescribedNode& node : trial.prescribed)
    b.segment<3>(3 * node.node) = rest.node_mass[node.node] * node.velocity;

  Eigen::SparseMatrix<double> A(3 * n, 3 * n);
  A.setFromTriplets(entries.begin(), entries.end());
  Cholesky cholesky;
  if (!b.allFinite() || !cholesky.factor(A)) return {.residual = 1};
  advance(cholesky.solve(b), dt, trial.state);

  const double creep = creep_per_step(rest.material, dt, kCreepDt);
  for (int t = 0; t < trial.mesh.tet_count(); ++t) {
    const Mat34 x = gather(trial.state.x, trial.mesh.tets[t]);
    const Mat3 Q = trial.method.rotation(deformation_gradient(x, rest.beta[t]));
    flow(rest.material.flow, element_strain(rest, t, x, Q), rest.material.yield, creep, rest.material.max_plastic,
         trial.state.plastic_strain[t]);
  }
  return {.iterations = 1, .converged = true};
}

SolveReport symplectic_euler(SoftTrial& trial, double dt) {
  Eigen::VectorXd f(trial.force.size());
  elastic_forces(trial.rest, trial.mesh.tets, trial.state.x, trial.state.plastic_strain, trial.pool,
                 trial.scratch.system.elements, f);
  f += trial.force;
  for (int i = 0; i < trial.mesh.node_count(); ++i)
    trial.state.v[i] += dt / trial.rest.node_mass[i] * f.segment<3>(3 * i);
  set_prescribed(trial);
  for (int i = 0; i < trial.mesh.node_count(); ++i) trial.state.x[i] += dt * trial.state.v[i];
  plastic_flow(trial.rest, trial.mesh.tets, trial.state.x, dt, kCreepDt, trial.pool, trial.state.plastic_strain,
               trial.scratch.system.elements);
  return {.converged = true};
}

Mat3 plain_polar_rotation(const Mat3& F) {
  if (!F.allFinite()) return Mat3::Identity();
  const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace crumple::lab::stability
