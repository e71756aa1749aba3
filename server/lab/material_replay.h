#pragma once

#include "server/lab/yardstick_case.h"

#include <map>

namespace crumple::lab {

struct ReplayReport {
  double max_relative_error = 0;
  std::map<std::string, double> by_test;
};

// Replays a material case: paths.json (strain path -> plastic strain and stress after each update, raw per-update
// creep) or states.json (F -> Q, strain, stress, P, energy density). The error of an array is
// max |got - ref| / max(max |ref|, floor), floor 1e-3 for strains, 1e-3 E for stresses, 1 for Q, 1e-6 E for energy.
Result<ReplayReport> replay_material(const std::filesystem::path& case_dir);

}  // namespace crumple::lab
