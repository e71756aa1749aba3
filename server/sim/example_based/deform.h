#pragma once

#include "server/sim/example_based/example_state.h"
#include "server/sim/example_based/propagation.h"
#include "server/sim/parallel_for.h"

#include <span>
#include <vector>

// One step of an example-based body: impulses in, a new shape out. Jones et al. 2016, sections 3.2 and 3.3.
namespace crumple::sim::example_based {

struct VertexImpulse {
  int vertex = 0;
  Vec3 impulse = Vec3::Zero();  // j_i [N s] in the asset's axes
  double share = 1;             // part of the plastic displacement that acts at this vertex; see impulse_site.h
};

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
};

// Where the time of one step went [ms]; all 0 without a clock.
struct DeformTimes {
  double projection = 0;   // eqs. 4, 5, 8
  double propagation = 0;  // eq. 11
  double weights = 0;      // eqs. 13, 15
  double skinning = 0;     // eq. 3
};

// Buffers and constants found on the way, one a body. No state: a new one gives the same bits.
struct ExampleWorkspace {
  PropagationCache cache;
  std::vector<WeightChange> changes;
  std::vector<Vec3> dx;
  std::vector<int> changed;
  DeformReport report;
  double (*now_ms)() = nullptr;  // the caller's clock, if times are wanted
  DeformTimes times;             // of the last `deform`

  double now() const { return now_ms ? now_ms() : 0; }
};

struct StepTimes {
  double dt = 1.0 / 250;       // the step [s]
  double rate_dt = 1.0 / 250;  // dt_ref of alpha and lambda [s] (SceneDescription::rate_dt)
};

// Projects all impulses at the shape as it stands (eqs. 4, 5, 8), spreads them into dE (eq. 11), updates C_r (eq. 15),
// applies a part of dE (eq. 13) and skins what changed (eq. 3). mass: of the body, constant [kg]. With no impulse above
// beta and no active row only C_r is computed. The report is valid until the next call with this workspace.
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
