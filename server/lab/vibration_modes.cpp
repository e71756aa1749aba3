#include "server/lab/vibration_modes.h"

#include "common/text.h"
#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/cholesky.h"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <numbers>
#include <random>

namespace crumple::lab {
namespace {

constexpr double kShift = 1e-7;    // of the largest K_ii / M_ii
constexpr double kRigid = 1e-10;   // eigenvalues below this part of it are rigid modes
constexpr double kSettled = 1e-11; // relative change of the wanted eigenvalues between two iterations
constexpr int kMaxIterations = 1000;

}  // namespace

Result<std::vector<double>> natural_frequencies(const Level& level, const Material& material, int count) {
  auto rest = rest_body(level, material);
  if (!rest) return std::unexpected(rest.error());

  const std::vector<char> fixed = level.fixed_dofs();
  std::vector<int> id(fixed.size(), -1), dofs;
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (fixed[i]) continue;
    id[i] = static_cast<int>(dofs.size());
    dofs.push_back(static_cast<int>(i));
  }
  const int n = static_cast<int>(dofs.size());
  if (count < 1 || count > n) return invalid("count", text("is ", count, ", must be in [1, ", n, "]"));

  Eigen::VectorXd mass(n);
  for (int i = 0; i < n; ++i) mass[i] = rest->node_mass[dofs[i] / 3];
  const std::vector<Mat3> no_strain(rest->point_count(), Mat3::Zero());
  const Eigen::SparseMatrix<double> full = sim::fem::tangent_stiffness(*rest, level.mesh.tets, level.mesh.X, no_strain,
                                                                       sim::fem::Tangent::fixed_rotation);
  std::vector<Eigen::Triplet<double>> entries;
  double highest = 0;
  for (int c = 0; c < full.outerSize(); ++c) {
    for (Eigen::SparseMatrix<double>::InnerIterator at(full, c); at; ++at) {
      if (id[c] < 0 || id[at.row()] < 0) continue;
      entries.emplace_back(id[at.row()], id[c], at.value());
      if (at.row() == c) highest = std::max(highest, at.value() / mass[id[c]]);
    }
  }
  Eigen::SparseMatrix<double> K(n, n), shifted(n, n);
  K.setFromTriplets(entries.begin(), entries.end());
  const double shift = kShift * highest;
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, shift * mass[i]);
  shifted.setFromTriplets(entries.begin(), entries.end());
  sim::linear_solver::Cholesky solver;
  if (!solver.factor(shifted)) return std::unexpected(Error{ErrorCode::internal, "", "the stiffness matrix cannot be factored"});

  const int block = std::min(n, 2 * count + 8);
  std::mt19937_64 random(1);
  Eigen::MatrixXd V(n, block);
  for (double& v : V.reshaped()) v = std::uniform_real_distribution(-1.0, 1.0)(random);
  Eigen::VectorXd values = Eigen::VectorXd::Zero(block);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    for (int j = 0; j < block; ++j) V.col(j) = solver.solve((mass.array() * V.col(j).array()).matrix());
    // Rayleigh-Ritz in the block.
    const Eigen::MatrixXd k = V.transpose() * (K * V), w = V.transpose() * mass.asDiagonal() * V;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> ritz((k + k.transpose()) / 2, (w + w.transpose()) / 2);
    if (ritz.info() != Eigen::Success) return std::unexpected(Error{ErrorCode::internal, "", "the modes did not settle"});
    V = (V * ritz.eigenvectors()).eval();
    const double change = ((ritz.eigenvalues() - values).cwiseAbs().array() / (ritz.eigenvalues().cwiseAbs().array() + shift)).head(count).maxCoeff();
    values = ritz.eigenvalues();
    if (change < kSettled) break;
  }
  std::vector<double> frequencies;
  for (int j = 0; j < count; ++j) {
    frequencies.push_back(values[j] < kRigid * highest ? 0 : std::sqrt(values[j]) / (2 * std::numbers::pi));
  }
  return frequencies;
}

}  // namespace crumple::lab
