#pragma once

#include "server/lab/chart/point.h"
#include "server/lab/chart/setup.h"
#include "server/lab/chart/workshop.h"

#include <functional>
#include <string>
#include <vector>

// The table of everything that is charted. A study is one figure: a measure on a scene, and curves through it. A new
// solver, element, integrator, contact rule or example option is one more curve, or one more value of a knob.
namespace crumple::lab::chart {

// One run of a set-up against the study's reference.
struct Measure {
  std::function<Result<Sample>(const Setup&, Workshop&)> run;
  std::function<Result<std::uint64_t>(const Setup&, Workshop&)> scene_hash;
};

// A knob on the study's scene. Orders are those of error ~ value^order; 0: none is expected.
struct Curve {
  std::string name;
  Knob knob;
  Setup base;
  double expected_order = 0;
  std::string why_few;  // why it has fewer than five points
};

// Measured by others, on their machine, on the same scene.
struct PeerPoint {
  std::string name;
  double error, seconds;
};

enum class FigureKind {
  work_precision,  // error across, seconds up; further panels with another quantity up
  pareto,          // the same with the front, coloured by the part of the error that dominates
  against_value,   // knob's value across, error up
  cost,            // knob's value across, seconds up
  ensemble,        // settings across, statistics with bands up
};

// A quantity up in place of seconds; "value" is the knob's.
struct PanelAxis {
  std::string quantity, name;
};

struct Study {
  std::string name, title;
  std::string scene;      // what is run, in one or two sentences
  std::string reference;  // what it is compared with, whose, and how sure it is
  Measure measure;
  std::vector<Curve> curves;
  FigureKind kind = FigureKind::work_precision;
  std::string error_axis = "relative error";
  std::string cost_axis = "wall seconds per simulated second";
  bool real_time = true;          // seconds are per simulated second
  std::vector<PanelAxis> more;    // further panels of the same points
  std::string value_axis;         // of the knob's value, where that goes across
  std::vector<PeerPoint> peers;
  std::vector<std::string> statistics;     // of an ensemble: quantities, in order of the panels
  std::string unmet;              // why the whole study cannot run; it then stands in the page with this sentence, or
                                  // with the points that an earlier run has left
  bool ranked = true;             // a small error is a good one; false: a gap between two models, neither of them the truth
  bool scene_a_curve = false;     // each curve is a scene of its own: its cheapest setting is looked for apart
  bool seeds = false;             // runs are seeds, not repeats
};

// All studies. What needs references that are not at hand says so in `unmet`.
std::vector<Study> studies(const Workshop& workshop);

// What a curve's knob could also turn and cannot yet; the page lists it.
struct NotBuilt {
  std::string what, why;
};
std::vector<NotBuilt> not_built();

}  // namespace crumple::lab::chart
