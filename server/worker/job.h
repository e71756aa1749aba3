#pragma once

#include "common/error.h"
#include "server/scene_convert/recording_convert.h"
#include "server/sim/scene.h"

#include <filesystem>
#include <functional>

namespace crumple::worker {

struct Job {
  sim::SceneDescription scene;
  scene_convert::RecordingSettings recording;
  int steps = 0;
  int threads = 1;
  std::filesystem::path out;   // folder of the results; made, or emptied of an older run's
};

struct JobReport {
  std::uint64_t state_hash = 0;
  double wall_ms = 0;          // of the steps alone
  int splits = 0, plastic_impulses = 0, capped_solves = 0;
};

// Steps a scene and writes what its recording asks for into `out`:
//   recording.crumple   frames and events (io/recording.h)
//   BODY/NNNNNN.vtu, BODY.pvd   finite-element bodies;  BODY/NNNNNN.ply   every other moving body
//   energies.csv events.csv timings.csv
//   result.json         state hash, steps, totals; written last, so that a folder with it is whole
// The same job gives the same files but for times of the wall clock. Everything is written beside `out` and moved there at
// the end: a job that is stopped leaves nothing half done, one that is repeated replaces its folder.
// on_step(k) is called after each step. Errors: those of World::create, a folder that cannot be written.
Result<JobReport> run_job(const Job& job, const std::function<void(int)>& on_step);

}  // namespace crumple::worker
