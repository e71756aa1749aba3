#pragma once

#include "server/lab/benchmark.h"
#include "server/lab/chart/figure.h"

#include <array>
#include <functional>
#include <span>

// Tables 1 and 2 and figure 11 of Jones et al. 2016 for the scenes of destruction_scenes.h.
namespace crumple::lab::chart {

// Parts of the deformation, in the order of sim::example_based::ExampleTimes.
inline constexpr std::array<const char*, 6> kDeformationParts{"locate", "projection", "propagation", "weights", "skinning", "shape"};

struct ExampleTimesOptions {
  int threads = 2;
  int repeats = 3;  // runs of each scene: a step's times are medians over them
  int steps = 0;    // of each run; 0: as destruction_steps says
};

// One scene, one entry a step, in milliseconds.
struct SceneTimes {
  std::string name;
  double dt = 0;  // [s]
  int joints = 0;
  Json assets;    // as `assets_of` has them
  std::vector<double> whole, rigid, deformation;
  std::array<std::vector<double>, kDeformationParts.size()> parts;  // processor time, summed over bodies
  std::uint64_t state_hash = 0;
};

// Errors: of destruction_scene and of World::create; INTERNAL where two runs end in different states.
Result<SceneTimes> time_example_scene(const std::string& name, const ExampleTimesOptions& options,
                                      const std::function<void(int done, int all)>& on_run);

// Sizes, times and where deformation goes, as three Markdown tables with a line of who made them.
std::string example_tables_markdown(std::span<const SceneTimes> scenes, const std::string& made_on);

// A row a scene: scene,rigid,deformation,whole,mean,worst,steps,state_hash and the parts, [ms] (medians of a step, but for mean and worst;
// the parts are means).
std::string example_tables_csv(std::span<const SceneTimes> scenes);

// The paper's figure 11: what each frame of 1/60 s costs, rigid step and parts of the deformation stacked.
Figure frame_figure(const SceneTimes& scene, const std::string& made_on);

// `page` with what stands between the lines "<!-- crumple-lab tables -->" and "<!-- end of crumple-lab tables -->" replaced.
// Error: one of them is missing, or they stand the wrong way round.
Result<std::string> with_tables(const std::string& page, const std::string& tables);

}  // namespace crumple::lab::chart
