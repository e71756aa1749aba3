#pragma once

#include "common/error.h"
#include "server/lab/chart/statistics.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace crumple::lab::chart {

// What one run of one setting gave. Names that mean the same everywhere:
//   error       relative, against the study's reference [-]
//   seconds     wall seconds per simulated second; of a static solve: wall seconds
//   iterations  of conjugate gradients a step; of a static solve: Newton's
struct Sample {
  std::map<std::string, double> values;
  std::string failure;  // what went wrong; empty: nothing. A failed run stays on the chart
};

// One setting, run several times: repeats of the same bits, or seeds of a chaotic scene.
struct Point {
  std::string study, curve, label;
  double value = 0;                       // of the knob
  int runs = 0;
  std::string failure;                    // of the first run that failed
  std::map<std::string, Spread> measured;
  std::string scene_hash, commit, machine, compiler;

  // Median of a quantity, NaN if it was not measured.
  double median(const std::string& name) const;
};

// points.csv: every point, a line each, written as it comes. Error and seconds have columns of their own; all
// quantities stand in the last one as name=low|q1|median|q3, parted by blanks. A line that does not parse (cut off by
// an interruption) is skipped: its point is run again.
std::string csv_header();
std::string csv_line(const Point& point);
std::vector<Point> read_points(const std::filesystem::path& file);

// The last point of this study, curve, label, scene and commit with so many runs or more; null if there is none.
const Point* find_point(const std::vector<Point>& points, const Point& wanted);

// A quick run's references are coarser and its runs fewer: its points carry this behind their commit and never stand in
// for full ones.
inline constexpr const char* kQuickMark = " quick";
bool is_quick(const Point& point);

}  // namespace crumple::lab::chart
