#include "server/lab/trajectory.h"

#include "common/text.h"
#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/cholesky.h"

#include <cmath>
#include <memory>

namespace crumple::lab {
namespace {

namespace fem = sim::fem;

constexpr double kMaxSubsteps = 1e7;

// Undamped mesh under dead loads and gravity; advances by one substep at a time.
class Motion {
 public:
  Motion(const Level& level, fem::RestBody rest, const Run& run, double h)
      : level_(level), run_(run), h_(h), rest_(std::move(rest)) {
    state_.x = level.mesh.X;
    state_.v = level.initial_velocity.empty() ? std::vector<Vec3>(state_.x.size(), Vec3::Zero()) : level.initial_velocity;
    state_.plastic_strain.assign(level.mesh.tets.size(), Mat3::Zero());
    f_ext_ = run.loads ? level.loads : Eigen::VectorXd::Zero(level.loads.size()).eval();
    for (std::size_t n = 0; n < state_.x.size(); ++n) f_ext_.segment<3>(3 * n) += rest_.node_mass[n] * run.gravity;
    fixed_ = level.fixed_dofs();
    for (const Dirichlet& d : level.dirichlet) state_.v[d.node][d.dof] = 0;
    factor_constant_part();
  }

  // (M + h^2 K) v+ = M v + h (f_ext + f_elastic(x)), fixed dofs struck; x+ = x + h v+. With a direct factor the solve is
  // converged to rounding. K at rest serves the linear model for good, the corotational one has a new K a step.
  bool step() {
    Eigen::VectorXd force = f_ext_ + elastic_force();
    if (run_.corotational && !factor(stiffness())) return false;
    Eigen::VectorXd b(force.size());
    for (std::size_t n = 0; n < state_.x.size(); ++n) {
      b.segment<3>(3 * n) = rest_.node_mass[n] * state_.v[n] + h_ * force.segment<3>(3 * n);
    }
    for (Eigen::Index i = 0; i < b.size(); ++i) {
      if (fixed_[i]) b[i] = 0;
    }
    const Eigen::VectorXd v = solver_.solve(b);
    if (!v.allFinite()) return false;
    for (std::size_t n = 0; n < state_.x.size(); ++n) {
      state_.v[n] = v.segment<3>(3 * n);
      state_.x[n] += h_ * state_.v[n];
    }
    return true;
  }

  void record(double time, Trajectory& out) {
    out.times.push_back(time);
    const Vec3 tip = state_.x[level_.tip];
    out.tip.push_back(tip);
    out.tip_uz.push_back(tip.z() - level_.mesh.X[level_.tip].z());
    Vec3 P = Vec3::Zero(), L = Vec3::Zero();
    double energy = elastic_energy();
    for (std::size_t n = 0; n < state_.x.size(); ++n) {
      const Vec3 p = rest_.node_mass[n] * state_.v[n];
      P += p;
      L += state_.x[n].cross(p);
      energy += 0.5 * p.dot(state_.v[n]) - rest_.node_mass[n] * run_.gravity.dot(state_.x[n]);
    }
    out.momentum.push_back(P);
    out.angular_momentum.push_back(L);
    out.energy.push_back(energy);
  }
  const std::vector<Vec3>& x() const { return state_.x; }

 private:
  void factor_constant_part() {
    K_rest_ = fem::tangent_stiffness(rest_, level_.mesh.tets, level_.mesh.X, state_.plastic_strain, fem::Tangent::fixed_rotation);
    if (!run_.corotational) factor(K_rest_);
  }
  Eigen::SparseMatrix<double> stiffness() const {
    return fem::tangent_stiffness(rest_, level_.mesh.tets, state_.x, state_.plastic_strain, fem::Tangent::fixed_rotation);
  }
  bool factor(const Eigen::SparseMatrix<double>& K) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int c = 0; c < K.outerSize(); ++c) {
      entries.emplace_back(c, c, fixed_[c] ? 1.0 : rest_.node_mass[c / 3]);
      for (Eigen::SparseMatrix<double>::InnerIterator at(K, c); at; ++at) {
        if (!fixed_[c] && !fixed_[at.row()]) entries.emplace_back(at.row(), c, h_ * h_ * at.value());
      }
    }
    Eigen::SparseMatrix<double> A(K.rows(), K.cols());
    A.setFromTriplets(entries.begin(), entries.end());
    return solver_.factor(A);
  }
  Eigen::VectorXd displacement() const {
    Eigen::VectorXd u(3 * state_.x.size());
    for (std::size_t n = 0; n < state_.x.size(); ++n) u.segment<3>(3 * n) = state_.x[n] - level_.mesh.X[n];
    return u;
  }
  Eigen::VectorXd elastic_force() {
    if (!run_.corotational) return -(K_rest_ * displacement());
    Eigen::VectorXd f(3 * state_.x.size());
    fem::elastic_forces(rest_, level_.mesh.tets, state_.x, state_.plastic_strain, pool_, elements_, f);
    return f;
  }
  double elastic_energy() const {
    if (run_.corotational) return fem::elastic_energy(rest_, level_.mesh.tets, state_.x, state_.plastic_strain);
    const Eigen::VectorXd u = displacement();
    return 0.5 * u.dot(K_rest_ * u);
  }

  const Level& level_;
  const Run& run_;
  double h_;
  fem::RestBody rest_;
  fem::FemState state_;
  Eigen::VectorXd f_ext_;
  std::vector<char> fixed_;
  Eigen::SparseMatrix<double> K_rest_;
  sim::linear_solver::Cholesky solver_;
  sim::ThreadPool pool_{1};
  fem::Elements elements_;
};

}  // namespace

Result<Trajectory> run_trajectory(const std::filesystem::path& case_dir, const std::string& name, double dt, int substeps,
                                  const std::string& integrator, const MaterialOverride& override) {
  if (integrator != "backward_euler") return invalid("integrator", "is " + integrator + ", must be backward_euler");
  auto run = read_run(case_dir, name);
  if (!run) return std::unexpected(run.error());
  if (!(dt > 0 && dt <= 1)) return invalid("dt", text("is ", dt, ", must be in (0, 1]"));
  if (substeps < 1 || run->end / dt * substeps > kMaxSubsteps) {
    return invalid("substeps", text("is ", substeps, ", must be at least 1 and at most 1e7 in the whole run"));
  }
  auto level = read_level(case_dir, run->level);
  if (!level) return std::unexpected(level.error());
  if (level->tip < 0) return invalid(run->level + ".json: sets.tip", "is missing: a run reports a tip");
  auto material = read_material(case_dir, override);
  if (!material) return std::unexpected(material.error());

  auto rest = rest_body(*level, *material);
  if (!rest) return std::unexpected(rest.error());

  const double h = dt / substeps;
  Motion motion(*level, std::move(*rest), *run, h);
  Trajectory out;
  motion.record(0, out);
  std::size_t next_snapshot = 0;
  const auto entries = static_cast<std::int64_t>(std::floor(run->end / dt + 1e-9));
  for (std::int64_t k = 1; k <= entries; ++k) {
    for (int s = 1; s <= substeps; ++s) {
      if (!motion.step()) return std::unexpected(Error{ErrorCode::internal, "", text("the run left the range of numbers at entry ", k)});
      const double now = static_cast<double>(k - 1) * dt + s * h;
      while (next_snapshot < run->snapshots.size() && now >= run->snapshots[next_snapshot] - 1e-9 * h) {
        out.snapshots.emplace_back(run->snapshots[next_snapshot++], motion.x());
      }
    }
    motion.record(static_cast<double>(k) * dt, out);
  }
  return out;
}

}  // namespace crumple::lab
