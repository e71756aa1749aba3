#include "server/lab/stability/newton_statics.h"

#include "server/lab/stability/supports.h"
#include "server/sim/linear_solver/cholesky.h"

#include <cmath>

namespace crumple::lab::stability {

using namespace sim::fem;

std::unique_ptr<SoftTrial> elastica(const FemMethod& method, double times) {
  FemMaterial material;
  material.young = 1e7;
  material.poisson = 0;
  auto beam = std::make_unique<SoftTrial>(block({1, 0.1, 0.1}, {20, 2, 2}), material, method);
  for (int i = 0; i < beam->mesh.node_count(); ++i)
    if (beam->mesh.X[i].x() == 0) beam->prescribed.push_back({i, Vec3::Zero()});
  beam->force = traction(beam->mesh, 1, {0, 0, -times * 500.0 / 3});
  return beam;
}

NewtonRun newton(const SoftTrial& trial, Tangent tangent) {
  constexpr int kMost = 100;
  constexpr double kConverged = 1e-8;
  const std::vector<int> held = held_dofs(trial);
  const sim::ThreadPool pool(1);
  Elements elements;
  NewtonRun run{.x = trial.mesh.X};
  std::vector<Vec3>& x = run.x;
  for (;; ++run.iterations) {
    Eigen::VectorXd r(3 * trial.mesh.node_count());
    elastic_forces(trial.rest, trial.mesh.tets, x, trial.state.plastic_strain, pool, elements, r);
    r += trial.force;
    for (const int dof : held) r(dof) = 0;
    run.residual = r.norm() / trial.force.norm();
    run.converged = run.residual < kConverged;
    if (run.converged || run.iterations == kMost || !std::isfinite(run.residual)) return run;
    Eigen::SparseMatrix<double> K =
        tangent_stiffness(trial.rest, trial.mesh.tets, x, trial.state.plastic_strain, tangent);
    hold(held, K);
    sim::linear_solver::Cholesky cholesky;
    if (!cholesky.factor(K)) return run;
    const Eigen::VectorXd step = cholesky.solve(r);
    for (int i = 0; i < trial.mesh.node_count(); ++i) x[i] += step.segment<3>(3 * i);
  }
}

}  // namespace crumple::lab::stability
