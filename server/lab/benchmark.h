#pragma once

#include "server/lab/yardstick_case.h"
#include "server/sim/scene.h"

#include <functional>

namespace crumple::lab {

struct BenchmarkOptions {
  int threads = 1;
  int steps = 100;
  std::string tip;    // body whose mean displacement at its x = max face is reported; empty: none
};

// Steps a scene and reports, keys that do not apply left out:
//   {"ms_per_step": {"mean", "median", "p99", "worst"}, "stages": {name: mean ms},
//    "solver": {"iterations_mean", "residual_worst", "capped_steps"}, "tip": [x, y, z], "penetration_mm_worst",
//    "inverted", "fragments", "splits", "contacts_most", "state_hash", "peak_rss_mb"}
// Stages are named as the lines of World::step. inverted: most tets at once that had negative volume at a step's end.
// on_step(k) is called after each step, for a progress bar.
Result<Json> run_benchmark(const sim::SceneDescription& scene, const BenchmarkOptions& options,
                           const std::function<void(int)>& on_step);

}  // namespace crumple::lab
