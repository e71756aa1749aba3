#include "server/lab/chart/chart_run.h"

#include "common/text.h"
#include "server/lab/chart/motion.h"
#include "server/lab/chart/pinning.h"

#include <fstream>
#include <iomanip>
#include <sstream>

namespace crumple::lab::chart {
namespace {

std::string hexadecimal(std::uint64_t value) {
  std::ostringstream out;
  out << std::hex << std::setw(16) << std::setfill('0') << value;
  return out.str();
}

Setup turned(const Curve& curve, const KnobValue& value) {
  Setup setup = curve.base;
  curve.knob.turn(setup, value.value);
  return setup;
}

// The point without its measurements: what identifies it.
Point planned(const Study& study, const Curve& curve, const KnobValue& value, const RunOptions& options, Workshop& workshop) {
  Point point{.study = study.name, .curve = curve.name, .label = value.label, .value = value.value};
  point.runs = study.seeds ? options.seeds : options.runs;
  if (auto hash = study.measure.scene_hash(turned(curve, value), workshop)) point.scene_hash = hexadecimal(*hash);
  else point.failure = hash.error().text();
  point.commit = commit() + (options.quick ? kQuickMark : "");
  point.machine = machine_name();
  point.compiler = compiler_name();
  return point;
}

// Ends a last line that an interruption cut off.
bool ends_in_the_middle(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in || in.tellg() <= 0) return false;
  in.seekg(-1, std::ios::end);
  return in.get() != '\n';
}

Result<std::ofstream> open_points(const std::filesystem::path& file) {
  const bool fresh = !std::filesystem::exists(file) || std::filesystem::file_size(file) == 0;
  const bool torn = ends_in_the_middle(file);
  std::ofstream out(file, std::ios::app);
  if (torn) out << "\n";
  if (fresh) out << csv_header() << "\n";
  out.flush();
  if (!out) return invalid("--out", "is " + file.parent_path().string() + ", where points.csv cannot be written");
  return out;
}

}  // namespace

std::vector<Point> newest_points(const std::vector<Point>& points, const Study& study) {
  const auto last = [&](bool quick) -> const Point* {
    const Point* found = nullptr;
    for (const Point& p : points) {
      if (p.study == study.name && is_quick(p) == quick) found = &p;
    }
    return found;
  };
  const Point* newest = last(false);
  if (!newest) newest = last(true);
  std::vector<Point> out;
  if (!newest) return out;
  for (const Curve& curve : study.curves) {
    for (const KnobValue& value : curve.knob.values) {
      const Point* found = nullptr;
      for (const Point& p : points) {
        if (p.study == study.name && p.curve == curve.name && p.label == value.label && p.commit == newest->commit) found = &p;
      }
      if (found) out.push_back(*found);
    }
  }
  return out;
}

Point measure_point(const Study& study, const Curve& curve, const KnobValue& value, const RunOptions& options, Workshop& workshop) {
  Point point = planned(study, curve, value, options, workshop);
  if (!point.failure.empty()) return point;
  Setup setup = turned(curve, value);
  std::map<std::string, std::vector<double>> samples;
  const int wanted = point.runs;
  const double from = now_seconds();
  for (point.runs = 0; point.runs < wanted;) {
    if (study.seeds) setup.seed = point.runs + 1;
    const Pinning pinned(setup.threads == 1 ? 1 : allowed_processors());
    auto sample = study.measure.run(setup, workshop);
    ++point.runs;
    if (!sample) {
      point.failure = sample.error().text();
      break;
    }
    for (const auto& [name, v] : sample->values) samples[name].push_back(v);
    if (point.failure.empty()) point.failure = sample->failure;
    if (!study.seeds && (!point.failure.empty() || now_seconds() - from > options.enough_seconds)) break;
  }
  for (auto& [name, values] : samples) point.measured[name] = spread(std::move(values));
  return point;
}

Result<std::vector<Point>> run_studies(const std::vector<Study>& studies, const RunOptions& options, Workshop& workshop,
                                       const Progress& progress) {
  const std::vector<Point> before = read_points(options.points_file);
  auto file = open_points(options.points_file);
  if (!file) return std::unexpected(file.error());

  struct Task {
    const Study* study;
    const Curve* curve;
    const KnobValue* value;
    Point wanted;
    const Point* found;
  };
  std::vector<Task> tasks;
  int missing = 0;
  for (const Study& study : studies) {
    if (!study.unmet.empty()) continue;
    for (const Curve& curve : study.curves) {
      for (const KnobValue& value : curve.knob.values) {
        if (options.quick && value.heavy) continue;
        Task task{&study, &curve, &value, planned(study, curve, value, options, workshop), nullptr};
        if (options.enough_seconds < 1e9) task.wanted.runs = 1;
        task.found = find_point(before, task.wanted);
        missing += task.found == nullptr;
        tasks.push_back(std::move(task));
      }
    }
  }

  std::vector<Point> points;
  const double from = now_seconds();
  int ran = 0;
  for (const Task& task : tasks) {
    if (task.found) {
      points.push_back(*task.found);
      continue;
    }
    const double left = ran == 0 ? -1 : (now_seconds() - from) / ran * (missing - ran);
    progress(static_cast<int>(points.size()), static_cast<int>(tasks.size()),
             text(task.study->name, " / ", task.curve->name, " / ", task.value->label), left);
    points.push_back(measure_point(*task.study, *task.curve, *task.value, options, workshop));
    *file << csv_line(points.back()) << std::endl;
    if (!*file) return invalid("--out", "is " + options.points_file.parent_path().string() + ", where points.csv cannot be written any more");
    ++ran;
  }
  progress(static_cast<int>(points.size()), static_cast<int>(tasks.size()), "done", 0);
  return points;
}

}  // namespace crumple::lab::chart
