#include "server/lab/chart/timeline.h"

#include "common/text.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/chart/statistics.h"
#include "server/lab/clock.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

namespace crumple::lab::chart {
namespace {

struct Run {
  std::vector<double> ms;
  std::vector<std::vector<double>> parts;
};

// Fills in what does not depend on the clock.
Result<Run> run_once(const sim::SceneDescription& scene, int threads, int steps, Timeline& timeline) {
  const Pinning pinning(threads);
  auto world = sim::World::create(scene, {.threads = threads});
  if (!world) return std::unexpected(world.error());
  (*world)->set_clock(now_ms);
  Run run{{}, std::vector<std::vector<double>>(step_parts().size())};
  timeline.workload.clear();
  timeline.contacts.clear();
  for (int k = 0; k < steps; ++k) {
    const double start = now_ms();
    const sim::StepReport report = (*world)->step();
    run.ms.push_back(now_ms() - start);
    for (std::size_t p = 0; p < step_parts().size(); ++p) {
      double sum = 0;
      for (const sim::StageTime& stage : (*world)->stage_times())
        if (std::ranges::find(step_parts()[p].stages, stage.name) != step_parts()[p].stages.end()) sum += stage.ms;
      run.parts[p].push_back(sum);
    }
    timeline.workload.push_back(report.workload);
    timeline.contacts.push_back(report.contacts);
    (*world)->take_events();
  }
  const std::uint64_t hash = (*world)->state_hash();
  if (timeline.state_hash != 0 && timeline.state_hash != hash)
    return std::unexpected(Error{ErrorCode::internal, "scene", text("ends in another state with ", threads, " threads")});
  timeline.state_hash = hash;
  return run;
}

// Step by step over the runs.
std::vector<double> medians(const std::vector<std::vector<double>>& runs) {
  std::vector<double> out;
  for (std::size_t k = 0; k < runs.front().size(); ++k) {
    std::vector<double> at;
    for (const std::vector<double>& run : runs) at.push_back(run[k]);
    out.push_back(spread(at).median);
  }
  return out;
}

const char* const kThreadColours[] = {"#d1495b", "#0b6e99", "#3a8f4d", "#8a5fbf", "#e08e1b", "#5b5b5b"};
const char* const kPartColours[] = {"#0b6e99", "#d1495b", "#3a8f4d", "#e08e1b", "#8a5fbf", "#9a9a9a"};
constexpr int kWidth = 860, kPanelHeight = 250, kFooter = 40;

// One block of gnuplot data: a row a step.
std::string data(const std::string& name, const std::function<void(std::ostream&, std::size_t)>& row, const Timeline& t) {
  std::ostringstream out;
  out << std::setprecision(8) << "$" << name << " << EOD\n";
  for (std::size_t k = 0; k < t.contacts.size(); ++k) {
    out << static_cast<double>(k + 1) * t.dt;
    row(out, k);
    out << '\n';
  }
  out << "EOD\n";
  return out.str();
}

std::string columns(const char* block, const char* style, const std::vector<std::pair<std::string, std::string>>& lines) {
  std::string out = "plot ";
  for (std::size_t i = 0; i < lines.size(); ++i)
    out += text(i ? ", \\\n  " : "", "$", block, " using 1:", i + 2, " with ", style, " lc rgb '", lines[i].second, "' title '", lines[i].first, "'");
  return out;
}

}  // namespace

const std::vector<StepPart>& step_parts() {
  static const std::vector<StepPart> parts{{"solve", {"solve"}},
                                           {"assemble", {"assemble", "guard"}},
                                           {"contact", {"detect"}},
                                           {"fracture and plasticity", {"fracture", "plasticity"}},
                                           {"rigid and examples", {"rigid", "examples"}},
                                           {"other", {"commands", "kinematic", "sleep"}}};
  return parts;
}

Result<Timeline> run_timeline(const sim::SceneDescription& scene, const TimelineOptions& options,
                              const std::function<void(int, int)>& on_run) {
  Timeline timeline{.threads = options.threads, .dt = scene.dt};
  const int all = options.repeats * static_cast<int>(options.threads.size());
  int done = 0;
  for (const int threads : options.threads) {
    std::vector<std::vector<double>> ms;
    std::vector<std::vector<std::vector<double>>> parts(step_parts().size());
    for (int k = 0; k < options.repeats; ++k) {
      auto run = run_once(scene, threads, options.steps, timeline);
      if (!run) return std::unexpected(run.error());
      ms.push_back(std::move(run->ms));
      for (std::size_t p = 0; p < parts.size(); ++p) parts[p].push_back(std::move(run->parts[p]));
      on_run(++done, all);
    }
    timeline.ms.push_back(medians(ms));
    timeline.parts.clear();  // of the most threads
    for (const auto& part : parts) timeline.parts.push_back(medians(part));
  }
  return timeline;
}

Figure timeline_figure(const Timeline& t, const std::string& scene, const std::string& made_on) {
  const int height = 3 * kPanelHeight + kFooter;
  std::ostringstream out;
  out << data("steps", [&](std::ostream& row, std::size_t k) { for (const auto& ms : t.ms) row << ' ' << ms[k]; }, t);
  // Sums from the last part on, so that the first lies lowest and each is drawn before what is below it.
  out << data("parts", [&](std::ostream& row, std::size_t k) {
    double sum = 0;
    std::vector<double> sums;
    for (const auto& part : t.parts) sums.push_back(sum += part[k]);
    for (std::size_t p = sums.size(); p-- > 0;) row << ' ' << sums[p];
  }, t);
  out << data("work", [&](std::ostream& row, std::size_t k) {
    const sim::Workload& w = t.workload[k];
    row << ' ' << w.asleep_tets << ' ' << w.live_tets << ' ' << w.live_nodes << ' ' << t.contacts[k] << ' ' << w.rigid_fragments;
  }, t);
  out << "set multiplot\nset key outside right top samplen 1.5 font ',10'\nset grid ytics lc rgb '#dddddd'\nset tics font ',10'\n"
      << "set lmargin at screen 0.08\nset rmargin at screen 0.76\nset xrange [0:" << static_cast<double>(t.contacts.size()) * t.dt << "]\n"
      << "set yrange [0:*]\n";
  const auto panel = [&](int index, const std::string& title, const std::string& y_label) {
    const double top = 1 - (index * kPanelHeight + 30.0) / height, bottom = 1 - ((index + 1) * kPanelHeight - 42.0) / height;
    out << "set tmargin at screen " << top << "\nset bmargin at screen " << bottom << "\nset title '" << title << "' font ',12' offset 0,-0.6\n"
        << "set ylabel '" << y_label << "' font ',10'\nset xlabel 'simulated time [s]' font ',10' offset 0,0.5\n";
  };
  std::vector<std::pair<std::string, std::string>> lines;
  for (std::size_t i = 0; i < t.threads.size(); ++i)
    lines.emplace_back(text(t.threads[i], t.threads[i] == 1 ? " thread" : " threads"), kThreadColours[i % std::size(kThreadColours)]);
  panel(0, scene + ": time per step", "ms");
  out << columns("steps", "lines lw 1.2", lines) << ", \\\n  " << 1000 * t.dt << " with lines dt 2 lc rgb '#333333' title 'real time'\n";
  lines.clear();
  for (std::size_t p = step_parts().size(); p-- > 0;) lines.emplace_back(step_parts()[p].name, kPartColours[p]);
  panel(1, text("its parts, with ", t.threads.back(), t.threads.back() == 1 ? " thread" : " threads"), "ms");
  out << columns("parts", "filledcurves x1 fs solid 0.85", lines) << "\n";
  panel(2, "what it is busy with", "number");
  out << "set label 1 '" << made_on << "' at screen 0.02, screen " << 14.0 / height << " font ',8' tc rgb '#666666'\n";
  out << columns("work", "lines lw 1.2",
                 {{"sleeping tets", "#9a9a9a"}, {"live tets", "#0b6e99"}, {"live nodes", "#3a8f4d"}, {"contacts", "#d1495b"}, {"rigid fragments", "#e08e1b"}})
      << "\nunset multiplot\n";
  return {out.str(), kWidth, height};
}

std::string timeline_csv(const Timeline& t) {
  std::ostringstream out;
  out << "step,time";
  for (const int threads : t.threads) out << ",ms_" << threads;
  for (const StepPart& part : step_parts()) out << ',' << part.name;
  out << ",live_tets,asleep_tets,live_nodes,rigid_fragments,contacts\n" << std::setprecision(6);
  for (std::size_t k = 0; k < t.contacts.size(); ++k) {
    out << k + 1 << ',' << static_cast<double>(k + 1) * t.dt;
    for (const auto& ms : t.ms) out << ',' << ms[k];
    for (const auto& part : t.parts) out << ',' << part[k];
    const sim::Workload& w = t.workload[k];
    out << ',' << w.live_tets << ',' << w.asleep_tets << ',' << w.live_nodes << ',' << w.rigid_fragments << ',' << t.contacts[k] << '\n';
  }
  return out.str();
}

}  // namespace crumple::lab::chart
