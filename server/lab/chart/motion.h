#pragma once

#include "server/lab/chart/point.h"
#include "server/lab/yardstick_case.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

// Motions of scenes, sampled at times that every charted dt reaches.
namespace crumple::lab::chart {

inline constexpr double kSampleInterval = 1.0 / 15;  // [s]

struct Motion {
  std::vector<double> tip;    // mean displacement of the probe nodes, three a sample, from the first interval on [m]
  std::vector<double> nodes;  // sqrt(m) u of every node, sample after sample: differences have mass-weighted norms
  double seconds = 0;         // wall time of the steps for a simulated second
  double iterations = 0;      // of conjugate gradients a step
  int capped_steps = 0;
  double energy = 0;          // kinetic + elastic + gravitational at the end [J]
  double energy_lost = 0;     // of it since the start, over the largest kinetic energy of a sample [-]
  Sample stages;              // where the steps' time went (StageSplit); empty for direct runs
  std::string failure;        // not finite, inverted at the end
};

// Steps a scene whose body 0 is of finite elements for `end` seconds in a World. probe: node ids.
Result<Motion> step_world(const sim::SceneDescription& scene, int threads, double end, const std::vector<int>& probe);

// The same steps with every system solved by a direct factorisation: what is left of the differences is the iterative
// solver's. For one elastic body of finite elements with nodes held fixed, nothing to touch and no script.
Result<Motion> step_directly(const sim::SceneDescription& scene, double end, const std::vector<int>& probe);

// Of what is simulated, not of how: gravity, bodies, shapes and materials in all bits; not dt, tolerances, caps,
// precision or rules.
std::uint64_t scene_hash(const sim::SceneDescription& scene);
std::uint64_t level_hash(const Level& level, const Material& material);

double now_seconds();  // of a steady clock

}  // namespace crumple::lab::chart
