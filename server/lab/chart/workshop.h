#pragma once

#include "server/lab/yardstick_case.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crumple::lab::chart {

// What measures share: where references lie, and what they have computed already. References that take long are made
// once in a run of the program, when the first point needs them.
struct Workshop {
  std::filesystem::path yardstick;  // folder of reference cases; may not exist
  bool quick = false;

  bool has(const std::string& case_name) const { return std::filesystem::exists(yardstick / case_name / "case.json"); }
  std::map<std::string, std::vector<double>> arrays;  // by a name that says everything it depends on
  std::map<std::string, double> floors;               // uncertainty of a reference
};

}  // namespace crumple::lab::chart
