#include "server/lab/stability/beam_and_modes.h"

#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/cholesky.h"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace crumple::lab::stability {

using namespace sim::fem;

double cantilever_ratio(double poisson) {
  constexpr double L = 10, h = 1, F = 1;
  FemMaterial material = soft_material();
  material.poisson = poisson;
  SoftTrial beam(block({L, h, h}, {20, 2, 2}), material, methods_of(Family::fem).front()->fem);
  Eigen::SparseMatrix<double> K =
      tangent_stiffness(beam.rest, beam.mesh.tets, beam.mesh.X, beam.state.plastic_strain, Tangent::fixed_rotation);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(K.rows());
  std::vector<int> tip;
  for (int i = 0; i < beam.mesh.node_count(); ++i) {
    if (beam.mesh.X[i].x() == L) tip.push_back(i);
    if (beam.mesh.X[i].x() > 0) continue;
    for (int c = 0; c < 3; ++c) K.coeffRef(3 * i + c, 3 * i + c) += 1e6 * material.young;  // held, but for 1e-6
  }
  for (const int i : tip) f(3 * i + 1) = F / static_cast<double>(tip.size());
  sim::linear_solver::Cholesky cholesky;
  if (!cholesky.factor(K)) return 0;
  const Eigen::VectorXd u = cholesky.solve(f);
  double deflection = 0;
  for (const int i : tip) deflection += u(3 * i + 1) / static_cast<double>(tip.size());
  const double I = h * h * h * h / 12, G = material.young / (2 * (1 + poisson));
  return deflection / (F * L * L * L / (3 * material.young * I) + F * L / (5.0 / 6 * G * h * h));
}

std::vector<Mode> free_modes(const SoftTrial& trial, int count) {
  const Eigen::MatrixXd K =
      tangent_stiffness(trial.rest, trial.mesh.tets, trial.mesh.X, trial.state.plastic_strain, Tangent::fixed_rotation);
  Eigen::VectorXd root(K.rows());
  for (int i = 0; i < trial.mesh.node_count(); ++i)
    root.segment<3>(3 * i).setConstant(1 / std::sqrt(trial.rest.node_mass[i]));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(root.asDiagonal() * K * root.asDiagonal());
  std::vector<Mode> modes;
  for (int k = 0; k < count; ++k) {
    const int column = 6 + k;  // behind the rigid motions
    Mode mode{std::sqrt(solver.eigenvalues()(column)), root.asDiagonal() * solver.eigenvectors().col(column)};
    mode.shape /= mode.shape.cwiseAbs().maxCoeff();
    modes.push_back(std::move(mode));
  }
  return modes;
}

}  // namespace crumple::lab::stability
