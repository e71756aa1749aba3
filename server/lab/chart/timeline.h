#pragma once

#include "server/lab/chart/figure.h"
#include "server/sim/scene.h"
#include "server/sim/world.h"

#include <functional>

// A scene step by step: figures 6, 7 and 8 of Parker & O'Brien 2009 for any scene.
namespace crumple::lab::chart {

// Parts of a step, drawn one on top of the other; the names of World::step's stages that each takes in.
struct StepPart {
  const char* name;
  std::vector<std::string> stages;
};
const std::vector<StepPart>& step_parts();

struct TimelineOptions {
  std::vector<int> threads{1, 2};  // ascending, at most 256 each
  int steps = 300;
  int repeats = 3;  // of each number of threads: a step's time is the median over them
};

// One entry a step.
struct Timeline {
  std::vector<int> threads;
  double dt = 0;                        // [s]
  std::vector<std::vector<double>> ms;  // by number of threads [ms]
  std::vector<std::vector<double>> parts;  // by step_parts, with the most threads [ms]
  std::vector<sim::Workload> workload;  // at the step's end
  std::vector<int> contacts;
  std::uint64_t state_hash = 0;
};

// Runs the scene as often as the options say; all runs must end in the same state, else INTERNAL. on_run(done, all).
Result<Timeline> run_timeline(const sim::SceneDescription& scene, const TimelineOptions& options,
                              const std::function<void(int, int)>& on_run);

// Three panels over simulated time: time per step by number of threads, its parts stacked, and the workload.
Figure timeline_figure(const Timeline& timeline, const std::string& scene, const std::string& made_on);

// step,time,ms_1,...,the parts,live_tets,asleep_tets,live_nodes,rigid_fragments,contacts.
std::string timeline_csv(const Timeline& timeline);

}  // namespace crumple::lab::chart
