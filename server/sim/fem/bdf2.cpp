#include "server/sim/fem/bdf2.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <functional>

namespace crumple::sim::fem {

using linear_solver::SolveReport;

namespace {

constexpr int kTetsPerChunk = 1024;
constexpr double kMass = 1.5, kTheta = 2.0 / 3;
constexpr double kNearInversion = 0.2;  // of the rest volume

// x+ but for 2/3 dt v+.
Vec3 known_position(const Vec3& x, const Vec3& x_before) { return x + (x - x_before) / 3; }

bool near_inversion(const RestBody& rest, const std::vector<Tet>& tets, const FemState& state, double dt,
                    const ThreadPool& pool) {
  const auto look = [&](int begin, int end) {
    for (int t = begin; t < end; ++t) {
      const Mat3 D = edge_matrix(gather(state.x, tets[t])), D_dot = edge_matrix(gather(state.v, tets[t]));
      const double bound = kNearInversion * 6 * rest.volume[t];
      // Not `<`: what is not finite is no place to extrapolate from.
      if (!(D.determinant() >= bound && (D + dt * D_dot).determinant() >= bound)) return true;
    }
    return false;
  };
  return pool.any_chunk(rest.tet_count(), kTetsPerChunk, std::cref(look));
}

}  // namespace

void forget(FemState& state) {
  state.x_before.clear();
  state.v_before.clear();
  state.rough_steps = 0;
}

void restart(FemState& state, int steps) {
  const int rough_steps = std::max(state.rough_steps, steps);
  forget(state);
  state.rough_steps = rough_steps;
}

void restart_near_inversion(const RestBody& rest, const std::vector<Tet>& tets, double dt, const ThreadPool& pool,
                            FemState& state) {
  if (near_inversion(rest, tets, state, dt, pool)) restart(state, kRoughAfterInversion);
}

StepSystem::Scale bdf2_scale(double dt) { return {dt, kMass, kTheta}; }

StepFormula bdf2_formula(const FemState& state, double dt, std::span<const PrescribedNode> prescribed,
                         Bdf2Scratch& scratch) {
  const std::size_t n = state.x.size();
  assert(state.x_before.size() == n && state.v_before.size() == n);
  for (std::vector<Vec3>* list : {&scratch.w, &scratch.x_known, &scratch.x_predicted}) list->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    scratch.w[i] = 2 * state.v[i] - 0.5 * state.v_before[i];
    scratch.x_known[i] = known_position(state.x[i], state.x_before[i]);
    scratch.x_predicted[i] = state.x[i] + dt * state.v[i];
  }
  for (const PrescribedNode& p : prescribed) {
    scratch.x_predicted[p.node] = state.x[p.node] + dt * p.velocity;
    scratch.x_known[p.node] = state.x[p.node] + (1 - kTheta) * dt * p.velocity;
  }
  return {.dt = dt,
          .mass = kMass,
          .position = kTheta,
          .w = scratch.w,
          .x_known = scratch.x_known,
          .x_linear = scratch.x_predicted};
}

void advance_bdf2(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt, std::span<const char> prescribed,
                  FemState& state) {
  const std::size_t n = state.x.size();
  assert(v_plus.size() == 3 * static_cast<Eigen::Index>(n) && prescribed.size() == n);
  const bool two_steps = remembers(state);
  state.x_before.resize(n);
  state.v_before.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 v = v_plus.segment<3>(3 * i), x = state.x[i];
    const bool two = two_steps && !prescribed[i];
    state.x[i] = two ? Vec3(known_position(x, state.x_before[i]) + kTheta * dt * v) : Vec3(x + dt * v);
    state.x_before[i] = x;
    state.v_before[i] = state.v[i];
    state.v[i] = v;
  }
  if (state.rough_steps == 0) return;
  const int left = state.rough_steps - 1;
  forget(state);
  state.rough_steps = left;
}

SolveReport bdf2_step(const RestBody& rest, const std::vector<Tet>& tets, FemState& state,
                      Eigen::Ref<const Eigen::VectorXd> f_ext, std::span<const PrescribedNode> prescribed,
                      const StepOptions& options, const ThreadPool& pool, StepScratch& scratch, Bdf2Scratch& bdf2) {
  restart_near_inversion(rest, tets, options.dt, pool, state);
  const StepFormula formula = remembers(state) ? bdf2_formula(state, options.dt, prescribed, bdf2)
                                               : backward_euler_formula(state, options.dt);
  assemble(rest, tets, state, formula, f_ext, prescribed, pool, scratch.system);
  linear_solver::SolveOptions solve_options = options.solve;
  if (remembers(state)) solve_options.tolerance *= kBdf2Tolerance;
  const SolveReport report = solve(solve_options, pool, scratch);
  advance_bdf2(scratch.velocity, options.dt, scratch.system.prescribed, state);
  plastic_flow(rest, tets, state.x, options.dt, options.creep_dt, pool, state.plastic_strain, scratch.system.elements);
  return report;
}

}  // namespace crumple::sim::fem
