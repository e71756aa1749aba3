#pragma once

#include "server/lab/chart/study.h"

#include <functional>

namespace crumple::lab::chart {

struct RunOptions {
  std::filesystem::path points_file;  // points.csv: read for what is done, appended to
  int runs = 10;                      // repeats of a point
  int seeds = 20;                     // of an ensemble
  double enough_seconds = 1e9;        // no further repeat of a point when it took so long already; seeds are all run
  bool quick = false;                 // leave out heavy values
};

// done: points behind, in front of `total`; what: "study / curve / setting"; left: estimated seconds.
using Progress = std::function<void(int done, int total, const std::string& what, double left)>;

// Runs every point of the studies that is not in the file yet, in the order of the table, and appends each as it comes.
// One processor for one thread, all for several. Points that failed are kept; so is a set-up that is refused, with its
// error as failure. Returns the points of these studies, in order. Error: the file cannot be written.
Result<std::vector<Point>> run_studies(const std::vector<Study>& studies, const RunOptions& options, Workshop& workshop,
                                       const Progress& progress);

// What a page shows of a study that was not run now: the points of the commit that was measured last, in the order of the
// table, without those whose curve or setting is not in it any more. Points of quick runs only where there are no others.
std::vector<Point> newest_points(const std::vector<Point>& points, const Study& study);

// One point, measured: `runs` samples become spreads. For ensembles the set-up's seed counts up from 1.
Point measure_point(const Study& study, const Curve& curve, const KnobValue& value, const RunOptions& options, Workshop& workshop);

}  // namespace crumple::lab::chart
