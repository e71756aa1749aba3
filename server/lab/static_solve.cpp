#include "server/lab/static_solve.h"

#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/cholesky.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <limits>
#include <memory>

namespace crumple::lab {
namespace {

constexpr double kTolerance = 1e-10;
constexpr int kMaxNewton = 60;
constexpr double kSmallestLoadStep = 1.0 / 256;

using Sparse = Eigen::SparseMatrix<double>;

// The free dofs of a system: rows and columns of the others are struck.
class FreeDofs {
 public:
  explicit FreeDofs(const std::vector<char>& fixed) : id_(fixed.size(), -1) {
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      if (fixed[i]) continue;
      id_[i] = static_cast<int>(dofs_.size());
      dofs_.push_back(static_cast<int>(i));
    }
  }
  int count() const { return static_cast<int>(dofs_.size()); }
  Eigen::VectorXd gather(const Eigen::VectorXd& full) const { return full(dofs_); }
  void scatter(const Eigen::VectorXd& free, Eigen::VectorXd& full) const { full(dofs_) = free; }
  Sparse gather(const Sparse& full) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (int c = 0; c < full.outerSize(); ++c) {
      if (id_[c] < 0) continue;
      for (Sparse::InnerIterator at(full, c); at; ++at) {
        if (id_[at.row()] >= 0) entries.emplace_back(id_[at.row()], id_[c], at.value());
      }
    }
    Sparse free(count(), count());
    free.setFromTriplets(entries.begin(), entries.end());
    return free;
  }

 private:
  std::vector<int> id_, dofs_;
};

// K^-1 b in one precision or the other; false if K is not positive definite.
class DirectSolver {
 public:
  explicit DirectSolver(Precision precision) : precision_(precision) {}
  bool factor(const Sparse& K) {
    if (precision_ == Precision::double_) return double_.factor(K);
    single_.compute(K.cast<float>());
    return single_.info() == Eigen::Success && single_.vectorD().minCoeff() > 0;
  }
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const {
    if (precision_ == Precision::double_) return double_.solve(b);
    // Single precision has a narrow range as well: the right-hand side is scaled into it.
    const double scale = b.cwiseAbs().maxCoeff();
    if (scale == 0) return b;
    return scale * single_.solve((b / scale).cast<float>()).cast<double>();
  }

 private:
  Precision precision_;
  sim::linear_solver::Cholesky double_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<float>> single_;
};

// A level with its matter: internal forces and tangents at given displacements.
class Structure {
 public:
  Structure(const Level& level, sim::fem::RestBody rest)
      : level_(level), free_(level.fixed_dofs()), rest_(std::move(rest)), plastic_(rest_.point_count(), Mat3::Zero()),
        x_(level.mesh.X) {}
  const FreeDofs& free() const { return free_; }
  const std::vector<Vec3>& x() const { return x_; }  // where they were placed last

  Eigen::VectorXd internal_forces(const Eigen::VectorXd& u) {
    place(u);
    Eigen::VectorXd f(u.size());
    sim::fem::elastic_forces(rest_, level_.mesh.tets, x_, plastic_, pool_, elements_, f);
    return f;
  }
  double energy(const Eigen::VectorXd& u) {
    place(u);
    return sim::fem::elastic_energy(rest_, level_.mesh.tets, x_, plastic_);
  }
  Sparse tangent(const Eigen::VectorXd& u, sim::fem::Tangent kind) {
    place(u);
    return sim::fem::tangent_stiffness(rest_, level_.mesh.tets, x_, plastic_, kind);
  }

 private:
  void place(const Eigen::VectorXd& u) {
    for (std::size_t n = 0; n < x_.size(); ++n) x_[n] = level_.mesh.X[n] + u.segment<3>(3 * n);
  }
  const Level& level_;
  FreeDofs free_;
  sim::fem::RestBody rest_;
  std::vector<Mat3> plastic_;
  std::vector<Vec3> x_;
  sim::ThreadPool pool_{1};
  sim::fem::Elements elements_;
};

struct Newton {
  bool converged = false;
  double residual = 0;
  int iterations = 0;
};

// r = load + internal forces of the free dofs, relative.
double relative_residual(const FreeDofs& free, const Eigen::VectorXd& internal, const Eigen::VectorXd& load) {
  const double scale = std::max(load.norm(), internal.norm());
  return scale == 0 ? 0 : free.gather(internal + load).norm() / scale;
}

// What rounding alone leaves of the free residual, relative: positions, and so strains, are known to eps |x|, which
// under a small load on a large body is more than kTolerance of the forces. |eps |K| |x||, K being the tangent at u.
double rounding_floor(const FreeDofs& free, const Sparse& K, const std::vector<Vec3>& x, double scale) {
  Eigen::VectorXd size(K.cols());
  for (std::size_t n = 0; n < x.size(); ++n) size.segment<3>(3 * n) = x[n].cwiseAbs();
  const Eigen::VectorXd noise = std::numeric_limits<double>::epsilon() * (K.cwiseAbs() * size);
  return scale == 0 ? 0 : free.gather(noise).norm() / scale;
}

// Newton from u, whose fixed dofs are in place and stay. A step is halved until the residual falls or the potential
// does: a slender part that turns must pass through states of larger residual. Where the exact tangent is indefinite the
// fixed-rotation one, which never is, gives the direction; both point downhill.
Newton newton(Structure& structure, const Eigen::VectorXd& load, Precision precision, Eigen::VectorXd& u) {
  const FreeDofs& free = structure.free();
  Newton report;
  Eigen::VectorXd internal = structure.internal_forces(u);
  report.residual = relative_residual(free, internal, load);
  while (report.residual > kTolerance && report.iterations < kMaxNewton) {
    // A step that gains nothing more at the level of rounding is the last.
    const double scale = std::max(load.norm(), internal.norm()), last = report.residual;
    const double floor = rounding_floor(free, structure.tangent(u, sim::fem::Tangent::fixed_rotation), structure.x(), scale);
    const auto settled = [&] { return report.residual <= floor && report.residual > 0.5 * last; };
    ++report.iterations;
    DirectSolver solver(precision);
    if (!solver.factor(free.gather(structure.tangent(u, sim::fem::Tangent::exact))) &&
        !solver.factor(free.gather(structure.tangent(u, sim::fem::Tangent::fixed_rotation)))) {
      return report;
    }
    const Eigen::VectorXd direction = solver.solve(free.gather(internal + load));
    const Eigen::VectorXd from = free.gather(u);
    const double before = free.gather(internal + load).norm();
    const double potential = structure.energy(u) - load.dot(u);
    const double slope = -free.gather(internal + load).dot(direction);
    double step = 1;
    for (;; step *= 0.5) {
      if (step < 1e-4) {
        report.converged = last <= floor;
        if (report.converged) free.scatter(from, u);
        return report;
      }
      free.scatter(from + step * direction, u);
      internal = structure.internal_forces(u);
      const double after = free.gather(internal + load).norm();
      if (after < (1 - 1e-4 * step) * before) break;
      if (structure.energy(u) - load.dot(u) < potential + 1e-4 * step * slope) break;
      // At round-off the residual wobbles; a full step that stays below the tolerance is as good.
      if (step == 1 && relative_residual(free, internal, load) <= kTolerance) break;
    }
    report.residual = relative_residual(free, internal, load);
    if (settled()) {
      report.converged = true;
      return report;
    }
  }
  report.converged = report.residual <= kTolerance;
  return report;
}

}  // namespace

Result<StaticSolution> solve_static(const Level& level, const Material& material, Model model, Precision precision) {
  auto rest = rest_body(level, material);
  if (!rest) return std::unexpected(rest.error());
  Structure structure(level, std::move(*rest));
  const FreeDofs& free = structure.free();
  Eigen::VectorXd prescribed = Eigen::VectorXd::Zero(level.loads.size());
  for (const Dirichlet& d : level.dirichlet) prescribed[3 * d.node + d.dof] = d.value;

  StaticSolution solution;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(prescribed.size());
  Eigen::VectorXd reactions;
  if (model == Model::linear) {
    const Sparse K = structure.tangent(u, sim::fem::Tangent::fixed_rotation);
    u = prescribed;
    DirectSolver solver(precision);
    solution.converged = solver.factor(free.gather(K));
    if (solution.converged) free.scatter(solver.solve(free.gather(level.loads - K * prescribed)), u);
    reactions = K * u - level.loads;
    solution.residual = free.gather(reactions).norm() / std::max({level.loads.norm(), (K * u).norm(), 1e-300});
    // A mesh that can move away passes the factorisation by rounding alone, and shows here.
    solution.converged &= solution.residual <= (precision == Precision::double_ ? 1e-6 : 1e-2);
    solution.iterations = 1;
  } else {
    double reached = 0, step = 1;
    while (reached < 1 && step >= kSmallestLoadStep) {
      const double to = std::min(1.0, reached + step);
      Eigen::VectorXd trial = u;
      // Predictor: the supports' move, carried into the inside by the tangent.
      const Eigen::VectorXd move = (to - reached) * prescribed;
      const Sparse K = structure.tangent(u, sim::fem::Tangent::fixed_rotation);
      DirectSolver solver(precision);
      trial += move;
      if (solver.factor(free.gather(K))) {
        const Eigen::VectorXd inside = solver.solve(free.gather((-(K * move)).eval()));
        Eigen::VectorXd carried = Eigen::VectorXd::Zero(u.size());
        free.scatter(inside, carried);
        trial += carried;
      }
      const Newton report = newton(structure, to * level.loads, precision, trial);
      solution.iterations += report.iterations;
      solution.residual = report.residual;
      if (report.converged) {
        u = trial;
        reached = to;
        step *= 2;
      } else {
        step *= 0.5;
      }
    }
    solution.converged = reached >= 1;
    reactions = -(structure.internal_forces(u) + level.loads);
  }

  const std::vector<char> fixed = level.fixed_dofs();
  for (int n = 0; n < level.mesh.node_count(); ++n) {
    solution.displacements.push_back(u.segment<3>(3 * n));
    Vec3 reaction = reactions.segment<3>(3 * n);
    for (int k = 0; k < 3; ++k) {
      if (!fixed[3 * n + k]) reaction[k] = 0;
    }
    solution.reactions.push_back(reaction);
  }
  return solution;
}

}  // namespace crumple::lab
