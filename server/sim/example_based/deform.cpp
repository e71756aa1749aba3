#include "server/sim/example_based/deform.h"

#include "server/sim/example_based/application.h"
#include "server/sim/example_based/impulse_projection.h"
#include "server/sim/example_based/restitution.h"
#include "server/sim/example_based/secondary_goal.h"
#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::example_based {
namespace {

constexpr int kChunk = 8;  // impulses a task: a Jacobian is some microseconds

}  // namespace

void accumulate(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, double mass,
                std::span<const VertexImpulse> impulses, const ThreadPool& pool, ExampleState& state,
                ExampleWorkspace& work) {
  const double start = work.now();
  // Eq. 4 for all: what is not above beta costs no more than this.
  const double dt = projection_dt(parameters, times.dt, times.rate_dt);
  work.changes.clear();
  work.dx.clear();
  work.report.plastic.clear();
  work.report.rejected = 0;
  work.report.creeps = remember(rest, parameters, times.dt, impulses, state.fatigue, work.felt);
  for (const VertexImpulse& at : work.felt) {
    assert(at.vertex >= 0 && at.vertex < rest.vertex_count());
    if (!at.impulse.allFinite()) {
      ++work.report.rejected;
      continue;
    }
    const double beta = parameters.beta * rest.set->beta_scale_at(at.vertex);
    const Vec3 dx = at.share * plastic_displacement(at.impulse, dt, mass, beta);
    if (dx.isZero(0)) continue;
    work.report.plastic.push_back({at.vertex, at.impulse.norm()});
    work.changes.push_back({at.vertex, {}});
    work.dx.push_back(dx);
  }

  pool.for_chunks(static_cast<int>(work.changes.size()), kChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      WeightChange& change = work.changes[k];
      const Jacobian J = skinning_jacobian(rest, change.vertex, state.E.row(change.vertex).transpose());
      // eqs. 8, 9 and 10 are all linear in alpha
      change.de = rest.set->alpha_scale_at(change.vertex) * weight_change(parameters, J, work.dx[k]);
    }
  });
  std::erase_if(work.changes, [](const WeightChange& change) { return change.de.isZero(0); });
  const double projected = work.now();
  propagate(rest, parameters, work.changes, pool, work.cache, state.dE, state.active);
  work.times.projection = projected - start;
  work.times.propagation = work.now() - projected;
}

void release(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, const ThreadPool& pool,
             ExampleState& state, ExampleWorkspace& work) {
  DeformReport& report = work.report;
  const double start = work.now();
  report.dE_frobenius = accumulator_norm(rest, parameters, state);
  report.restitution = state.restitution =
      update_restitution(parameters, state.restitution, times.dt, report.dE_frobenius);
  report.moved = false;
  report.finite = true;
  work.changed.clear();
  const bool dents = !state.active.empty();
  work.times.weights = work.times.skinning = 0;
  if (is_at_rest(state)) return;

  if (!dents) {
    pursue_goal(rest, parameters, pool, state, work.changed);
  } else {
    leave_goal(state);
    if (parameters.keep_volume) work.before.keep(state, state.active);
    apply_delayed(parameters, lambda_per_step(parameters, times.dt, times.rate_dt), pool, state, work.changed);
  }
  const double applied = work.now();
  work.times.weights = applied - start;
  report.moved = skin(rest, state.E, work.changed, pool, state.x);
  if (parameters.keep_volume && dents && give_back_volume(rest, work.before, pool, state)) {
    work.changed = work.before.vertices;
    report.moved |= skin(rest, state.E, work.changed, pool, state.x);
  }
  if (dents && state.active.empty()) begin_goal(parameters, state);
  report.finite = std::all_of(work.changed.begin(), work.changed.end(), [&](int i) { return state.x[i].allFinite(); });
  work.times.skinning = work.now() - applied;
}

const DeformReport& deform(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, double mass,
                           std::span<const VertexImpulse> impulses, const ThreadPool& pool, ExampleState& state,
                           ExampleWorkspace& work) {
  accumulate(rest, parameters, times, mass, impulses, pool, state, work);
  release(rest, parameters, times, pool, state, work);
  return work.report;
}

}  // namespace crumple::sim::example_based
