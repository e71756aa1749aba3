#include "server/lab/stability/beam_and_modes.h"

#include "server/lab/stability/supports.h"
#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/cholesky.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace crumple::lab::stability {

using namespace sim::fem;

namespace {

using Sparse = Eigen::SparseMatrix<double>;

// At the rest shape.
Sparse stiffness(const SoftTrial& trial) {
  return tangent_stiffness(trial.rest, trial.mesh.tets, trial.mesh.X, trial.state.plastic_strain,
                           Tangent::fixed_rotation);
}

}  // namespace

double cantilever_ratio(const FemMethod& method, double poisson) {
  constexpr double L = 10, h = 1, F = 1;
  FemMaterial material = soft_material();
  material.poisson = poisson;
  SoftTrial beam(block({L, h, h}, {20, 2, 2}), material, method);
  Sparse K = stiffness(beam);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(K.rows());
  std::vector<int> tip, held;
  for (int i = 0; i < beam.mesh.node_count(); ++i) {
    if (beam.mesh.X[i].x() == L) tip.push_back(i);
    if (beam.mesh.X[i].x() > 0) continue;
    for (int c = 0; c < 3; ++c) held.push_back(3 * i + c);
  }
  hold(held, K);
  for (const int i : tip) f(3 * i + 1) = F / static_cast<double>(tip.size());
  sim::linear_solver::Cholesky cholesky;
  if (!cholesky.factor(K)) return 0;
  const Eigen::VectorXd u = cholesky.solve(f);
  double deflection = 0;
  for (const int i : tip) deflection += u(3 * i + 1) / static_cast<double>(tip.size());
  const double I = h * h * h * h / 12, G = material.young / (2 * (1 + poisson));
  return deflection / (F * L * L * L / (3 * material.young * I) + F * L / (5.0 / 6 * G * h * h));
}

double cook_ratio(const FemMethod& method, double poisson, int across) {
  const double quadratic = poisson < 0.4 ? 2.389979 : poisson < 0.495 ? 2.028249 : 1.994894;  // S10, c3d10_32
  FemMaterial material;
  material.young = 240.565;
  material.poisson = poisson;
  material.density = 1;
  sim::TetMesh mesh = block({1, 1, 4}, {across, across, across / 8});
  for (Vec3& X : mesh.X) X = {48 * X.x(), 44 * X.x() + X.y() * (44 - 28 * X.x()), X.z()};
  const SoftTrial membrane(mesh, material, method);
  Sparse K = stiffness(membrane);
  std::vector<int> held;
  int corner = 0;
  for (int i = 0; i < mesh.node_count(); ++i) {
    if (mesh.X[i].z() == 0 || mesh.X[i].z() == 4) held.push_back(3 * i + 2);  // plane strain
    if (mesh.X[i].x() == 0) held.insert(held.end(), {3 * i, 3 * i + 1});
    if ((mesh.X[i] - Vec3(48, 60, 0)).norm() < (mesh.X[corner] - Vec3(48, 60, 0)).norm()) corner = i;
  }
  hold(held, K);
  sim::linear_solver::Cholesky cholesky;
  if (!cholesky.factor(K)) return 0;
  return cholesky.solve(traction(mesh, 48, {0, 100, 0}))(3 * corner + 1) / quadratic;
}

std::vector<Mode> free_modes(const SoftTrial& trial, int count) {
  const Eigen::MatrixXd K = stiffness(trial);
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

ModeState mode_after(sim::Integrator integrator, double omega2, double load, ModeState now, double dt, int steps) {
  ModeState before = now;
  for (int k = 0; k < steps; ++k) {
    const bool two_steps = k > 0 && integrator == sim::Integrator::bdf2;
    const double third = two_steps ? 1.0 / 3 : 0, h = two_steps ? 2 * dt / 3 : dt;
    const double q = now.q + third * (now.q - before.q), v = now.v + third * (now.v - before.v);
    before = now;
    now.v = (v + h * (load - omega2 * q)) / (1 + h * h * omega2);
    now.q = q + h * now.v;
  }
  return now;
}

double energy_by_modes(const SoftTrial& trial, double dt, int steps) {
  const std::vector<int> held = held_dofs(trial);
  std::vector<int> free;
  for (int dof = 0; dof < 3 * trial.mesh.node_count(); ++dof)
    if (!std::ranges::count(held, dof)) free.push_back(dof);
  Eigen::VectorXd root(static_cast<long>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    root(static_cast<long>(k)) = 1 / std::sqrt(trial.rest.node_mass[free[k] / 3]);
  const Eigen::MatrixXd full = stiffness(trial), K = full(free, free);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(root.asDiagonal() * K * root.asDiagonal());
  const Eigen::VectorXd f = trial.force(free);
  const Eigen::VectorXd load = solver.eigenvectors().transpose() * root.cwiseProduct(f);
  double energy = 0;
  for (Eigen::Index k = 0; k < load.size(); ++k) {
    const double omega2 = solver.eigenvalues()(k);
    const ModeState mode = mode_after(trial.method.integrator, omega2, load(k), {}, dt, steps);
    energy += 0.5 * (mode.v * mode.v + omega2 * mode.q * mode.q);
  }
  return energy;
}

}  // namespace crumple::lab::stability
