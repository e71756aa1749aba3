#include "server/lab/trajectory.h"

#include "common/text.h"
#include "server/sim/fem/bdf2.h"
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
  Motion(const Level& level, fem::RestBody rest, const Run& run, double h, bool bdf2)
      : level_(level), run_(run), h_(h), bdf2_(bdf2), rest_(std::move(rest)) {
    state_.x = level.mesh.X;
    state_.v = level.initial_velocity.empty() ? std::vector<Vec3>(state_.x.size(), Vec3::Zero()) : level.initial_velocity;
    state_.plastic_strain.assign(rest_.point_count(), Mat3::Zero());
    f_ext_ = run.loads ? level.loads : Eigen::VectorXd::Zero(level.loads.size()).eval();
    for (std::size_t n = 0; n < state_.x.size(); ++n) f_ext_.segment<3>(3 * n) += rest_.node_mass[n] * run.gravity;
    fixed_ = level.fixed_dofs();
    for (const Dirichlet& d : level.dirichlet) state_.v[d.node][d.dof] = 0;
    none_prescribed_.assign(state_.x.size(), 0);
    if (!run.corotational) K_rest_ = stiffness(state_.x);
  }

  // (c M + theta h^2 K) v+ = M w + h (f_ext + f(x_known)), fixed dofs struck: fem::StepFormula without damping. With a
  // direct factor the solve is converged to rounding.
  bool step() {
    if (bdf2_) fem::restart_near_inversion(rest_, level_.mesh.tets, h_, pool_, state_);
    const fem::StepFormula formula =
        fem::remembers(state_) ? fem::bdf2_formula(state_, h_, {}, scratch_) : fem::backward_euler_formula(state_, h_);
    if (!factor(formula)) return false;
    Eigen::VectorXd b = h_ * (f_ext_ + elastic_force(formula));
    for (std::size_t n = 0; n < state_.x.size(); ++n) b.segment<3>(3 * n) += rest_.node_mass[n] * formula.w[n];
    for (Eigen::Index i = 0; i < b.size(); ++i) {
      if (fixed_[i]) b[i] = 0;
    }
    const Eigen::VectorXd v = solver_.solve(b);
    if (!v.allFinite()) return false;
    if (bdf2_) {
      fem::advance_bdf2(v, h_, none_prescribed_, state_);
    } else {
      fem::advance(v, h_, state_);
    }
    return true;
  }

  void record(double time, Trajectory& out) {
    out.times.push_back(time);
    const Vec3 tip = state_.x[level_.tip];
    out.tip.push_back(tip);
    out.tip_uz.push_back(tip.z() - level_.mesh.X[level_.tip].z());
    Vec3 P = Vec3::Zero(), L = Vec3::Zero();
    double kinetic = 0, gravitational = 0;
    for (std::size_t n = 0; n < state_.x.size(); ++n) {
      const Vec3 p = rest_.node_mass[n] * state_.v[n];
      P += p;
      L += state_.x[n].cross(p);
      kinetic += 0.5 * p.dot(state_.v[n]);
      gravitational -= rest_.node_mass[n] * run_.gravity.dot(state_.x[n]);
    }
    out.momentum.push_back(P);
    out.angular_momentum.push_back(L);
    out.kinetic.push_back(kinetic);
    out.elastic.push_back(elastic_energy());
    out.gravitational.push_back(gravitational);
    out.energy.push_back(kinetic + out.elastic.back() + gravitational);
  }
  const std::vector<Vec3>& x() const { return state_.x; }

 private:
  Eigen::SparseMatrix<double> stiffness(const std::vector<Vec3>& x) const {
    return fem::tangent_stiffness(rest_, level_.mesh.tets, x, state_.plastic_strain, fem::Tangent::fixed_rotation);
  }
  // The linear model's matrix changes with the formula only, the corotational one's in every step.
  bool factor(const fem::StepFormula& formula) {
    if (run_.corotational) return factor(formula, K_ = stiffness(formula.x_linear));
    if (formula.mass == factored_mass_) return true;
    factored_mass_ = formula.mass;
    return factor(formula, K_rest_);
  }
  bool factor(const fem::StepFormula& formula, const Eigen::SparseMatrix<double>& K) {
    const double part = formula.position * h_ * h_;
    std::vector<Eigen::Triplet<double>> entries;
    for (int c = 0; c < K.outerSize(); ++c) {
      entries.emplace_back(c, c, fixed_[c] ? 1.0 : formula.mass * rest_.node_mass[c / 3]);
      for (Eigen::SparseMatrix<double>::InnerIterator at(K, c); at; ++at) {
        if (!fixed_[c] && !fixed_[at.row()]) entries.emplace_back(at.row(), c, part * at.value());
      }
    }
    Eigen::SparseMatrix<double> A(K.rows(), K.cols());
    A.setFromTriplets(entries.begin(), entries.end());
    return solver_.factor(A);
  }
  static Eigen::VectorXd displacement(const std::vector<Vec3>& x, const std::vector<Vec3>& from) {
    Eigen::VectorXd u(3 * x.size());
    for (std::size_t n = 0; n < x.size(); ++n) u.segment<3>(3 * n) = x[n] - from[n];
    return u;
  }
  // f(x_linear) - K (x_known - x_linear), K that of the last factor().
  Eigen::VectorXd elastic_force(const fem::StepFormula& formula) {
    if (!run_.corotational) return -(K_rest_ * displacement(formula.x_known, level_.mesh.X));
    Eigen::VectorXd f(3 * state_.x.size());
    fem::elastic_forces(rest_, level_.mesh.tets, formula.x_linear, state_.plastic_strain, pool_, elements_, f);
    return f - K_ * displacement(formula.x_known, formula.x_linear);
  }
  double elastic_energy() const {
    if (run_.corotational) return fem::elastic_energy(rest_, level_.mesh.tets, state_.x, state_.plastic_strain);
    const Eigen::VectorXd u = displacement(state_.x, level_.mesh.X);
    return 0.5 * u.dot(K_rest_ * u);
  }

  const Level& level_;
  const Run& run_;
  double h_;
  bool bdf2_;
  fem::RestBody rest_;
  fem::FemState state_;
  Eigen::VectorXd f_ext_;
  std::vector<char> fixed_;            // by dof
  std::vector<char> none_prescribed_;  // by node: fixed dofs stay, since their velocity is zero
  fem::Bdf2Scratch scratch_;
  double factored_mass_ = 0;           // c of the factor that solver_ holds
  Eigen::SparseMatrix<double> K_rest_, K_;  // K_: of this step
  sim::linear_solver::Cholesky solver_;
  sim::ThreadPool pool_{1};
  fem::Elements elements_;
};

}  // namespace

Result<Trajectory> run_trajectory(const std::filesystem::path& case_dir, const std::string& name, double dt, int substeps,
                                  const std::string& integrator, const MaterialOverride& override) {
  if (integrator != "backward_euler" && integrator != "bdf2") {
    return invalid("integrator", "is " + integrator + ", must be backward_euler or bdf2");
  }
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
  Motion motion(*level, std::move(*rest), *run, h, integrator == "bdf2");
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
