#pragma once

#include "server/lab/yardstick_case.h"

namespace crumple::lab {

// What a run was at every DT from 0, and at its snapshot times.
struct Trajectory {
  std::vector<double> times;             // [s]
  std::vector<Vec3> tip;                 // position of the level's tip node [m]
  std::vector<double> tip_uz;            // its displacement along z [m]
  std::vector<Vec3> momentum;            // [kg m/s]
  std::vector<Vec3> angular_momentum;    // about the origin [kg m^2/s]
  std::vector<double> kinetic, elastic, gravitational;  // the last is -sum m g.x [J]
  std::vector<double> energy;            // their sum [J]
  std::vector<std::pair<double, std::vector<Vec3>>> snapshots;  // positions [m]
};

// Steps a run of case.json by linearised backward Euler ("backward_euler") or BDF2 ("bdf2"), `substeps` of DT / substeps
// for each entry of the result, undamped, every solve converged to 1e-12. A snapshot is taken at the first entry or
// substep that reaches its time. Nothing but what the case fixes does work: the energy falls by what the integrator damps.
// Errors: no such run or level, a tip-less level, DT outside (0, 1] or beyond 1e7 substeps in all, another integrator.
Result<Trajectory> run_trajectory(const std::filesystem::path& case_dir, const std::string& run, double dt, int substeps,
                                  const std::string& integrator, const MaterialOverride& material);

}  // namespace crumple::lab
