#pragma once

#include "server/lab/yardstick_case.h"
#include "server/sim/scene.h"

#include <functional>

namespace crumple::lab {

struct BenchmarkOptions {
  int threads = 1;
  int steps = 100;
  bool invariants = false;
  bool depth = false;  // vertex_depth.h
  double rigid_tolerance = 0;  // its residual [m/s]; 0: its own
  std::string tip;    // body whose mean displacement at its x = max face is reported; empty: none
};

// The distinct example-based assets of a scene, in order of the first body that has each:
//   [{"first": its name, "bodies", "vertices", "tets", "surface_triangles", "bones", "examples", "convex_parts"}]
Json assets_of(const sim::SceneDescription& scene);

// Steps a scene and reports, keys that do not apply left out:
//   {"ms_per_step": {"mean", "median", "p99", "worst", "end"}, "stages": {name: mean ms},
//    "solver": {"iterations_mean", "residual_worst", "capped_steps"}, "tip": [x, y, z], "penetration_mm_worst",
//    "inverted", "fragments", "splits", "contacts_most", "sleep": {"live_bodies", "asleep_bodies", "live_tets",
//    "asleep_tets", "live_nodes", "asleep_nodes", "asleep_fragments", "all_asleep_at"}, "state_hash", "peak_rss_mb",
//    "examples": {"assets": a list of sizes, "rigid_ms", "deform_ms": as ms_per_step of these two stages,
//    "parts_ms": {part of the deformation: mean, summed over bodies that run side by side}, "plastic_impulses"},
//    "rigid": {"sweeps_mean": of the rigid solver a step, "residual_median", "residual_worst": what the last sweep of a step
//    still changed [m/s]}}
// With `invariants` also {"invariants": {name: a list with an entry a step}}: "momentum", "angular_momentum" ([x, y, z]),
// "kinetic", "elastic", "gravitational" [J] after the step, "contact_work", "command_work", "prescribed_work" [J] in it
// (sim::Invariants). They are taken outside the time of the steps, but for a few per cent in "solve" and "rigid".
// With `depth` also {"vertex_depth_mm": {"worst", "end", "steps_over_20"}} (vertex_depth.h); steps_over_20: most steps on end
// whose depth was above 20 mm. Outside the time of the steps, too.
// Stages are named as the lines of World::step. end: mean of the last ten steps. inverted: most tets at once that had
// negative volume at a step's end. sleep: at the end, where the scene lets bodies sleep (or starts them so); all_asleep_at: the
// step from which on nothing was live, if it ends so.
// on_step(k) is called after each step, for a progress bar.
Result<Json> run_benchmark(const sim::SceneDescription& scene, const BenchmarkOptions& options,
                           const std::function<void(int)>& on_step);

}  // namespace crumple::lab
