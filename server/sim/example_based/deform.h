#pragma once

#include "server/sim/example_based/example_state.h"
#include "server/sim/example_based/example_times.h"
#include "server/sim/example_based/fatigue.h"
#include "server/sim/example_based/kept_volume.h"
#include "server/sim/example_based/propagation.h"
#include "server/sim/parallel_for.h"

#include <span>
#include <vector>

// One step of an example-based body: impulses in, a new shape out. Jones et al. 2016, sections 3.2 and 3.3.
namespace crumple::sim::example_based {

struct PlasticImpulse {
  int vertex;
  double magnitude;  // |j| [N s]
};

struct DeformReport {
  std::vector<PlasticImpulse> plastic;  // those above beta, in the order they came
  bool moved = false;                   // x changed: mass properties, hulls and drawing are out of date
  double dE_frobenius = 0;              // the norm that eq. 15 took [-]
  double restitution = 0;               // C_r after the step [-]
  int rejected = 0;                     // impulses that were not finite; they did nothing
  bool finite = true;                   // of every x this step wrote
  bool creeps = false;                  // below beta, but not if it lasts (fatigue.h)
};

// Buffers and constants found on the way, one a body. No state: a new one gives the same bits.
struct ExampleWorkspace {
  PropagationCache cache;
  std::vector<WeightChange> changes;
  std::vector<Vec3> dx;
  std::vector<int> changed;
  std::vector<VertexImpulse> felt;
  RowsBefore before;
  DeformReport report;
  double (*now_ms)() = nullptr;  // the caller's clock, if times are wanted
  ExampleTimes times;            // of the last `deform`: projection to skinning; the rest is the caller's

  double now() const { return now_ms ? now_ms() : 0; }
};

struct StepTimes {
  double dt = 1.0 / 250;       // the step [s]
  double rate_dt = 1.0 / 250;  // dt_ref of alpha and lambda [s] (SceneDescription::rate_dt)
};

// Projects all impulses at the shape as it stands (eqs. 4, 5, 8), spreads them into dE (eq. 11), updates C_r (eq. 15),
// applies a part of dE (eq. 13) and skins what changed (eq. 3), as the options beyond the paper have it. mass: of the body, constant
// [kg]. With no impulse above beta and a shape at rest only C_r is computed. The report is valid until the next call with this workspace.
const DeformReport& deform(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, double mass,
                           std::span<const VertexImpulse> impulses, const ThreadPool& pool, ExampleState& state,
                           ExampleWorkspace& work);

// The first half of `deform`, for whoever wants to see between: eqs. 4, 5, 8 and 11 into state.dE and state.active.
void accumulate(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, double mass,
                std::span<const VertexImpulse> impulses, const ThreadPool& pool, ExampleState& state,
                ExampleWorkspace& work);

// The second half: eqs. 15, 13 and 3, from state.dE.
void release(const ExampleRest& rest, const ExampleParameters& parameters, StepTimes times, const ThreadPool& pool,
             ExampleState& state, ExampleWorkspace& work);

}  // namespace crumple::sim::example_based
