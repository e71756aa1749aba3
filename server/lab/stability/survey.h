#pragma once

#include "server/lab/stability/heat_map.h"
#include "server/lab/stability/row.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>

// Runs rows and maps as jobs, each in a process of its own, with a journal to resume from and a progress bar.
namespace crumple::lab::stability {

struct RowResult {
  Outcome outcome;
  double seconds = 0;
  double slowest_step = 0;  // over the median one of its run (StepTimes); 0: not measured. Reported, not judged
};
struct CellResult {
  Cell cell;
  double seconds = 0;
};

struct CellKey {
  std::string map, method;
  int i = 0, j = 0;  // of x and y
  auto operator<=>(const CellKey&) const = default;
};
using RowKey = std::pair<int, std::string>;  // row number, method

struct Survey {
  std::map<RowKey, RowResult> rows;
  std::map<CellKey, CellResult> cells;

  CellGrid grid(const HeatMap& map,
                const std::string& method) const;  // cells that were not run are stable without a note
};

// What to run.
struct Plan {
  Effort effort;
  std::vector<RowKey> rows;
  std::vector<CellKey> cells;
};
Plan full_plan(const std::filesystem::path& references = {});  // of the yardstick, as in Effort
std::vector<RowKey> rows_of_brief();                           // of the regression part

// journal: a file that holds a line for each finished job; empty: none. Jobs that it holds are not run again; it is the
// caller's to remove. A progress bar with an estimate goes to standard error if that is a terminal, else a line now and
// then.
Survey run_survey(const Plan& plan, const std::filesystem::path& journal);

}  // namespace crumple::lab::stability
