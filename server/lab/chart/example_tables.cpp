#include "server/lab/chart/example_tables.h"

#include "common/text.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/chart/statistics.h"
#include "server/lab/clock.h"
#include "server/lab/destruction_scenes.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <numeric>
#include <sstream>

namespace crumple::lab::chart {
namespace {

// The figure that a scene is after, and what the authors' own program took on such a machine, with triangle-mesh collision,
// deformation of the pachinko on two threads, else on one [ms]. 0: not known.
struct Published {
  const char* figure;
  double rigid, deformation;
};
const std::map<std::string, Published>& published() {
  static const std::map<std::string, Published> kPublished{
      {"dock", {"3", 0.36, 0.55}},         {"pachinko", {"4", 5.81, 7.47}}, {"driver", {"8", 3.41, 2.98}}, {"pileup", {"1", 0.57, 0.31}},
      {"cannonballs", {"7", 0.02, 0.16}}, {"space", {"10", 5.9, 22.7}},   {"shipyard", {"9", 29.7, 3.92}}, {"pegs", {"-", 0, 0}}};
  return kPublished;
}

constexpr double kFrame = 1.0 / 60;  // [s]
constexpr int kWidth = 860, kHeight = 360, kFooter = 34;
const char* const kColours[] = {"#9a9a9a", "#5b5b5b", "#d1495b", "#e08e1b", "#3a8f4d", "#8a5fbf", "#0b6e99"};  // rigid, then the parts
constexpr const char* kBegin = "<!-- crumple-lab tables -->\n";
constexpr const char* kEnd = "<!-- end of crumple-lab tables -->\n";

struct Run {
  std::vector<double> whole, rigid, deformation;
  std::array<std::vector<double>, kDeformationParts.size()> parts;
  std::uint64_t state_hash = 0;
};

Result<Run> run_once(const sim::SceneDescription& scene, int threads, int steps) {
  const Pinning pinning(threads);
  auto world = sim::World::create(scene, {.threads = threads});
  if (!world) return std::unexpected(world.error());
  (*world)->set_clock(now_ms);
  Run run;
  for (int k = 0; k < steps; ++k) {
    const double start = now_ms();
    (*world)->step();
    run.whole.push_back(now_ms() - start);
    for (const sim::StageTime& stage : (*world)->stage_times()) {
      if (stage.name == std::string_view("rigid")) run.rigid.push_back(stage.ms);
      if (stage.name == std::string_view("examples")) run.deformation.push_back(stage.ms);
    }
    const sim::example_based::ExampleTimes& t = (*world)->example_times();
    const double parts[] = {t.locate, t.projection, t.propagation, t.weights, t.skinning, t.shape};
    for (std::size_t p = 0; p < run.parts.size(); ++p) run.parts[p].push_back(parts[p]);
    (*world)->take_events();
  }
  run.state_hash = (*world)->state_hash();
  return run;
}

// Step by step over the runs. series(run) is one list of it.
template <class Series>
std::vector<double> medians(const std::vector<Run>& runs, const Series& series) {
  std::vector<double> out(series(runs.front()).size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    std::vector<double> at;
    for (const Run& run : runs) at.push_back(series(run)[k]);
    out[k] = spread(at).median;
  }
  return out;
}

double mean(const std::vector<double>& values) {
  return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::string fixed(double value, int digits) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << value;
  return out.str();
}

std::string sizes_row(const SceneTimes& scene) {
  std::string assets;
  for (const Json& a : scene.assets)
    assets += text(assets.empty() ? "" : "; ", a["bodies"].get<int>(), " x (", a["vertices"].get<int>(), ", ", a["tets"].get<int>(), ", ",
                   a["bones"].get<int>(), ", ", a["examples"].get<int>(), ")");
  const auto known = published().find(scene.name);
  return text("| ", scene.name, " | ", known == published().end() ? "-" : known->second.figure, " | ", assets, " | ", scene.joints, " |\n");
}

std::string times_row(const SceneTimes& scene) {
  const double whole = spread(scene.whole).median;
  std::string theirs = " | ";
  if (const auto known = published().find(scene.name); known != published().end() && known->second.rigid > 0) {
    const auto& [figure, rigid, deformation] = known->second;
    theirs = text(rigid, " + ", deformation, " | ", fixed((rigid + deformation) / whole, 1));
  }
  return text("| ", scene.name, " | ", fixed(spread(scene.rigid).median, 2), " | ", fixed(spread(scene.deformation).median, 2), " | ", fixed(whole, 2), " | ",
              fixed(mean(scene.whole), 2), " | ", fixed(std::ranges::max(scene.whole), 2), " | ", std::lround(1000 / whole), " | ", theirs, " |\n");
}

std::string parts_row(const SceneTimes& scene) {
  std::string row = text("| ", scene.name, " |");
  for (const std::vector<double>& part : scene.parts) row += text(" ", fixed(mean(part), 3), " |");
  return row + "\n";
}

}  // namespace

Result<SceneTimes> time_example_scene(const std::string& name, const ExampleTimesOptions& options,
                                      const std::function<void(int, int)>& on_run) {
  auto scene = destruction_scene(name, {});
  if (!scene) return std::unexpected(scene.error());
  SceneTimes result{.name = name, .dt = scene->dt, .joints = static_cast<int>(scene->joints.size()), .assets = assets_of(*scene)};
  std::vector<Run> runs;
  for (int k = 0; k < options.repeats; ++k) {
    auto run = run_once(*scene, options.threads, options.steps > 0 ? options.steps : destruction_steps().at(name));
    if (!run) return std::unexpected(run.error());
    runs.push_back(*std::move(run));
    if (runs.back().state_hash != runs.front().state_hash)
      return std::unexpected(Error{ErrorCode::internal, "scene", text(name, " ends in another state when it is run again")});
    on_run(k + 1, options.repeats);
  }
  result.whole = medians(runs, [](const Run& r) -> const auto& { return r.whole; });
  result.rigid = medians(runs, [](const Run& r) -> const auto& { return r.rigid; });
  result.deformation = medians(runs, [](const Run& r) -> const auto& { return r.deformation; });
  for (std::size_t p = 0; p < result.parts.size(); ++p)
    result.parts[p] = medians(runs, [p](const Run& r) -> const auto& { return r.parts[p]; });
  result.state_hash = runs.front().state_hash;
  return result;
}

std::string example_tables_markdown(std::span<const SceneTimes> scenes, const std::string& made_on) {
  std::string out = text("Sizes (the paper's table 1): bodies x (vertices, tets, bones, examples).\n\n",
                         "| scene | figure | assets | joints |\n|---|---|---|---|\n");
  for (const SceneTimes& scene : scenes) out += sizes_row(scene);
  out += text("\nTime (its table 2), medians of a step [ms]:\n\n",
              "| scene | rigid | deformation | whole step | mean | worst | steps a second | theirs | times faster |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const SceneTimes& scene : scenes) out += times_row(scene);
  out += "\nWhere deformation goes (its figure 11): processor time summed over bodies, mean of a step [ms]:\n\n| scene |";
  for (const char* part : kDeformationParts) out += text(" ", part, " |");
  out += "\n|---|";
  for (std::size_t p = 0; p < kDeformationParts.size(); ++p) out += "---|";
  out += "\n";
  for (const SceneTimes& scene : scenes) out += parts_row(scene);
  return out + text("\nMade by `crumple-lab tables`: ", made_on, ".\n");
}

std::string example_tables_csv(std::span<const SceneTimes> scenes) {
  std::ostringstream out;
  out << "scene,rigid,deformation,whole,mean,worst,steps,state_hash";
  for (const char* part : kDeformationParts) out << ',' << part;
  out << '\n' << std::setprecision(6);
  for (const SceneTimes& s : scenes) {
    out << s.name << ',' << spread(s.rigid).median << ',' << spread(s.deformation).median << ',' << spread(s.whole).median << ',' << mean(s.whole) << ','
        << std::ranges::max(s.whole) << ',' << s.whole.size() << ',' << std::hex << s.state_hash << std::dec;
    for (const std::vector<double>& part : s.parts) out << ',' << mean(part);
    out << '\n';
  }
  return out.str();
}

Figure frame_figure(const SceneTimes& scene, const std::string& made_on) {
  // Sums over the steps that begin in each frame; the last line drawn lies lowest.
  const auto frames = static_cast<std::size_t>(std::ceil(static_cast<double>(scene.whole.size()) * scene.dt / kFrame - 1e-9));
  std::vector<std::array<double, 1 + kDeformationParts.size()>> ms(frames);
  std::vector<double> whole(frames, 0);
  for (std::size_t k = 0; k < scene.whole.size(); ++k) {
    const auto f = std::min(frames - 1, static_cast<std::size_t>(static_cast<double>(k) * scene.dt / kFrame + 1e-9));
    whole[f] += scene.whole[k];
    ms[f][0] += scene.rigid[k];
    // Bodies deform side by side: the stage's time, shared as processor time is.
    double all = 0;
    for (const auto& part : scene.parts) all += part[k];
    for (std::size_t p = 0; p < scene.parts.size(); ++p)
      if (all > 0) ms[f][p + 1] += scene.deformation[k] * scene.parts[p][k] / all;
  }
  std::ostringstream out;
  out << std::setprecision(6) << "$frames << EOD\n";
  for (std::size_t f = 0; f < frames; ++f) {
    out << static_cast<double>(f + 1) * kFrame;
    double sum = 0;
    std::array<double, 1 + kDeformationParts.size()> sums;
    for (std::size_t p = 0; p < sums.size(); ++p) sums[p] = sum += ms[f][p];
    for (std::size_t p = sums.size(); p-- > 0;) out << ' ' << sums[p];
    out << ' ' << whole[f] << '\n';
  }
  out << "EOD\nset key outside right top samplen 1.5 font ',10'\nset grid ytics lc rgb '#dddddd'\nset tics font ',10'\n"
      << "set lmargin at screen 0.08\nset rmargin at screen 0.8\nset bmargin at screen " << (kFooter + 40.0) / kHeight << "\n"
      << "set xrange [0:" << static_cast<double>(frames) * kFrame << "]\nset yrange [0:*]\n"
      << "set title '" << scene.name << ": time per frame of 1/60 s' font ',12'\nset ylabel 'ms' font ',10'\nset xlabel 'simulated time [s]' font ',10'\n"
      << "set label 1 '" << made_on << "' at screen 0.02, screen " << 12.0 / kHeight << " font ',8' tc rgb '#666666'\nplot ";
  for (std::size_t p = 1 + kDeformationParts.size(); p-- > 0;) {
    const char* name = p == 0 ? "rigid bodies" : kDeformationParts[p - 1];
    out << "$frames using 1:" << 1 + kDeformationParts.size() - p + 1 << " with filledcurves x1 fs solid 0.85 lc rgb '" << kColours[p] << "' title '" << name << "', \\\n  ";
  }
  out << "$frames using 1:" << kDeformationParts.size() + 3 << " with lines lw 1 lc rgb '#222222' title 'whole step'\n";
  return {out.str(), kWidth, kHeight};
}

Result<std::string> with_tables(const std::string& page, const std::string& tables) {
  const std::size_t begin = page.find(kBegin), end = page.find(kEnd);
  if (begin == std::string::npos || end == std::string::npos || end < begin)
    return invalid("--page", text("must have the line \"", std::string(kBegin, std::string_view(kBegin).size() - 1), "\" and after it \"",
                                  std::string(kEnd, std::string_view(kEnd).size() - 1), "\""));
  return page.substr(0, begin) + kBegin + tables + page.substr(end);
}

}  // namespace crumple::lab::chart
