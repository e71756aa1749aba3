#include "server/authoring/bounded_biharmonic_weights.h"

#include "common/text.h"
#include "server/authoring/simplex_projection.h"
#include "server/authoring/tet_laplacian.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_tree.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace crumple::authoring {
namespace {

using sim::ThreadPool;
using sim::linear_solver::Cholesky;
using sim::linear_solver::RowMatrix;
using sim::linear_solver::SimultaneousSolve;
using Sparse = Eigen::SparseMatrix<double>;

// Which vertices are solved for, which are prescribed, and which follow others.
struct Parts {
  std::vector<int> free, known;
  std::vector<std::vector<int>> followers;  // parts without a handle, and vertices of no tet
  int components = 0, without_handle = 0;
};

Parts sort_vertices(const sim::TetMesh& mesh, const std::vector<int>& prescribed) {
  const int n = mesh.node_count();
  std::vector<int> root(n);
  std::iota(root.begin(), root.end(), 0);
  std::vector<char> meshed(n, false), held(n, false), known(n, false);
  for (const Tet& tet : mesh.tets)
    for (const int i : tet) {
      meshed[i] = true;
      sim::unite(root, tet[0], i);
    }
  for (const int i : prescribed) {
    known[i] = true;
    held[sim::find_root(root, i)] = true;
  }
  Parts out;
  out.known = prescribed;
  std::vector<int> follower_of(n, -1);
  for (int i = 0; i < n; ++i) {
    const int r = sim::find_root(root, i);
    if (meshed[i] && r == i) {
      ++out.components;
      out.without_handle += !held[i];
    }
    if (!held[r]) {
      if (follower_of[r] < 0) {
        follower_of[r] = static_cast<int>(out.followers.size());
        out.followers.emplace_back();
      }
      out.followers[follower_of[r]].push_back(i);
    } else if (!known[i]) {
      out.free.push_back(i);
    }
  }
  return out;
}

// Rows `rows` and columns `columns` of A.
Sparse block(const Sparse& A, const std::vector<int>& rows, const std::vector<int>& columns) {
  std::vector<int> row_of(A.rows(), -1);
  for (size_t k = 0; k < rows.size(); ++k) row_of[rows[k]] = static_cast<int>(k);
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t k = 0; k < columns.size(); ++k)
    for (Sparse::InnerIterator it(A, columns[k]); it; ++it)
      if (row_of[it.row()] >= 0) entries.emplace_back(row_of[it.row()], static_cast<int>(k), it.value());
  Sparse out(static_cast<int>(rows.size()), static_cast<int>(columns.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

double root_mean_square(const RowMatrix& A) { return A.norm() / std::sqrt(static_cast<double>(A.size())); }

// The energy as a function of the free rows X: 1/2 tr X^T Q X - tr R^T X + constant, Q = (L M^-1 L)_ff.
struct Energy {
  Sparse L_ff, L_fk, Q;
  Eigen::VectorXd M_f, M_k;
  RowMatrix R;
  double constant = 0;

  Energy(const TetLaplacian& laplacian, const Parts& parts, const RowMatrix& known) {
    const auto& [L, M] = laplacian;
    L_ff = block(L, parts.free, parts.free);
    L_fk = block(L, parts.free, parts.known);
    const Sparse L_kk = block(L, parts.known, parts.known);
    M_f = M(parts.free);
    M_k = M(parts.known);
    const Eigen::VectorXd f = M_f.cwiseInverse(), k = M_k.cwiseInverse();
    const Sparse L_kf = L_fk.transpose();
    Q = Sparse(L_ff * f.asDiagonal() * L_ff) + Sparse(L_fk * k.asDiagonal() * L_kf);
    const RowMatrix out_f = L_fk * known, out_k = L_kk * known;  // minus the Laplacian of the known rows, times M
    R = -(L_ff * (f.asDiagonal() * out_f)) - L_fk * (k.asDiagonal() * out_k);
    constant = 0.5 * (f.asDiagonal() * out_f).cwiseProduct(out_f).sum() +
               0.5 * (k.asDiagonal() * out_k).cwiseProduct(out_k).sum();
  }

  double operator()(const RowMatrix& X) const {
    const RowMatrix QX = Q * X;
    return 0.5 * X.cwiseProduct(QX).sum() - X.cwiseProduct(R).sum() + constant;
  }
};

// Q^-1 R: the weights without bounds. With A = L_ff M_f^-1 L_ff, Q is A + L_fk M_k^-1 L_kf, of as many ranks more as
// there are known rows (Woodbury's formula): a factor of L alone costs a tenth of Q's. Nothing where L cannot be
// factored.
std::optional<RowMatrix> unbounded_by_laplacian(const Energy& energy, const ThreadPool& pool) {
  Cholesky cholesky(Cholesky::Ordering::nested_dissection);
  if (!cholesky.factor(energy.L_ff)) return std::nullopt;
  const SimultaneousSolve solve(cholesky);
  const auto solve_A = [&](RowMatrix X) {
    solve.solve_in_place(X, pool);
    X.array().colwise() *= energy.M_f.array();
    solve.solve_in_place(X, pool);
    return X;
  };
  RowMatrix X = solve_A(energy.R);
  const RowMatrix G = solve_A(RowMatrix(energy.L_fk));
  Eigen::MatrixXd S = energy.L_fk.transpose() * G;
  S.diagonal() += energy.M_k;
  X -= G * S.partialPivLu().solve(Eigen::MatrixXd(energy.L_fk.transpose() * X));
  return X;
}

std::optional<RowMatrix> unbounded_weights(const Energy& energy, const ThreadPool& pool) {
  if (energy.L_fk.cols() <= std::min<Eigen::Index>(energy.L_fk.rows() / 8, 500))
    return unbounded_by_laplacian(energy, pool);
  Cholesky cholesky(Cholesky::Ordering::nested_dissection);
  if (!cholesky.factor(energy.Q)) return std::nullopt;
  RowMatrix X = energy.R;
  SimultaneousSolve(cholesky).solve_in_place(X, pool);
  return X;
}

// The free rows of W; nothing where a system cannot be factored.
std::optional<RowMatrix> minimise(const Energy& energy, const BiharmonicOptions& options, const ThreadPool& pool,
                                  BiharmonicReport& report) {
  constexpr double kRelaxation = 1.7, kImbalance = 5;
  constexpr int kMostFactors = 4, kCheckEvery = 10;
  if (energy.R.rows() == 0) {
    report.converged = true;
    report.energy = report.relaxed_energy = energy.constant;
    return RowMatrix(energy.R);
  }
  std::optional<RowMatrix> start = unbounded_weights(energy, pool);
  if (!start) return std::nullopt;
  RowMatrix X = std::move(*start), Z = X, U = RowMatrix::Zero(X.rows(), X.cols()), V, Z_before;
  project_rows_to_simplex(Z);
  report.primal_residual = root_mean_square(X - Z);
  if (report.primal_residual == 0) {
    report.converged = true;
    report.energy = report.relaxed_energy = energy(Z);
    return Z;
  }

  const Eigen::VectorXd diagonal = energy.Q.diagonal();
  double rho = 0.01;  // of the diagonal: of the best over solids, shells and bars; balanced below where it is not
  Cholesky cholesky(Cholesky::Ordering::nested_dissection);
  std::optional<SimultaneousSolve> solve;
  const auto factor = [&] {
    Sparse K = energy.Q;
    K.diagonal() += rho * diagonal;
    ++report.factors;
    if (!cholesky.factor(K)) return false;
    solve.emplace(cholesky);
    return true;
  };
  if (!factor()) return std::nullopt;

  while (report.iterations < options.max_iterations && !report.converged) {
    X = Z - U;
    X.array().colwise() *= rho * diagonal.array();
    X += energy.R;
    solve->solve_in_place(X, pool);
    V = kRelaxation * X + (1 - kRelaxation) * Z + U;
    Z_before = Z;
    Z = V;
    project_rows_to_simplex(Z);
    U = V - Z;

    ++report.iterations;
    report.primal_residual = root_mean_square(X - Z);
    report.dual_residual = root_mean_square(Z - Z_before);
    report.converged = std::max(report.primal_residual, report.dual_residual) <= options.tolerance;
    if (report.converged || report.iterations % kCheckEvery != 0 || report.factors == kMostFactors) continue;
    const double ratio = report.primal_residual / report.dual_residual;
    if (ratio > kImbalance || ratio < 1 / kImbalance) {
      const double change = std::clamp(ratio, 0.1, 10.0);
      rho *= change;
      U /= change;
      if (!factor()) return std::nullopt;
    }
  }
  report.energy = energy(Z);
  report.relaxed_energy = energy(X);
  return Z;
}

// Every part without a handle takes the row of that vertex, of those with weights, which is nearest to any of its own.
void follow_nearest(const sim::TetMesh& mesh, const Parts& parts, Eigen::MatrixXd& W) {
  std::vector<char> follows(mesh.X.size(), false);
  for (const auto& part : parts.followers)
    for (const int i : part) follows[i] = true;
  sim::TetMesh led{mesh.X, {}, {}};
  for (const Tet& tet : mesh.tets)
    if (!follows[tet[0]]) led.tets.push_back(tet);
  const sim::TetTree tree(led);
  for (const auto& part : parts.followers) {
    double nearest = std::numeric_limits<double>::infinity();
    int leader = -1;
    for (const int i : part) {
      const auto hit = tree.nearest(mesh.X[i]);
      if (!(hit.squared_distance < nearest)) continue;
      nearest = hit.squared_distance;
      leader = *std::ranges::min_element(led.tets[hit.tet], {},
                                         [&](int k) { return (mesh.X[k] - mesh.X[i]).squaredNorm(); });
    }
    for (const int i : part) W.row(i) = W.row(leader);
  }
}

Result<void> check(const BiharmonicOptions& o) {
  if (!(o.tolerance > 0 && o.tolerance <= 0.1))
    return invalid("tolerance", text("is ", o.tolerance, ", must be in (0, 0.1]"));
  if (o.max_iterations < 1 || o.max_iterations > 100000)
    return invalid("max_iterations", text("is ", o.max_iterations, ", must be in [1, 100000]"));
  if (!(o.reach >= 0)) return invalid("reach", text("is ", o.reach, ", must not be negative"));
  return {};
}

}  // namespace

Result<BiharmonicWeights> bounded_biharmonic_weights(const sim::TetMesh& mesh, const Handles& handles,
                                                     const BiharmonicOptions& options) {
  if (auto ok = check(options); !ok) return std::unexpected(ok.error());
  if (auto ok = sim::validate(mesh, "mesh"); !ok) return std::unexpected(ok.error());
  const auto prescribed = prescribed_weights(mesh, handles, options.reach);
  if (!prescribed) return std::unexpected(prescribed.error());
  const Parts parts = sort_vertices(mesh, prescribed->vertices);

  BiharmonicWeights out;
  out.report.components = parts.components;
  out.report.components_without_handle = parts.without_handle;
  out.report.shared_vertices = prescribed->shared;
  const ThreadPool alone(1);
  const Energy energy(tet_laplacian(mesh), parts, prescribed->weights);
  const auto free = minimise(energy, options, options.pool ? *options.pool : alone, out.report);
  if (!free || !free->allFinite())
    return invalid("mesh.tets", "are too badly shaped: the system of the weights cannot be factored");

  out.W.resize(mesh.node_count(), handles.count());
  out.W(parts.known, Eigen::all) = prescribed->weights;
  out.W(parts.free, Eigen::all) = *free;
  if (!parts.followers.empty()) follow_nearest(mesh, parts, out.W);
  return out;
}

}  // namespace crumple::authoring
