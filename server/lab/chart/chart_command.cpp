#include "server/lab/chart/chart_command.h"

#include "common/text.h"
#include "server/lab/chart/chart_run.h"
#include "server/lab/chart/figure.h"
#include "server/lab/chart/page.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/command_output.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>

namespace crumple::lab::chart {
namespace {

namespace fs = std::filesystem;

struct ChartCommand {
  std::string out, references = "../shared/yardstick", only;
  bool quick = false;

  int run() const;
};

void show_progress(int done, int total, const std::string& what, double left) {
  constexpr int kWidth = 24;
  const int filled = total > 0 ? kWidth * done / total : kWidth;
  std::ostringstream line;
  line << "[" << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] " << done << "/" << total;
  if (left > 0) line << "  about " << (left < 90 ? text(std::lround(left), " s") : text(std::lround(left / 60), " min")) << " left";
  line << "  " << what;
  if (isatty(STDERR_FILENO)) std::cerr << "\r\033[K" << line.str() << (done == total ? "\n" : "") << std::flush;
  else std::cerr << line.str() << "\n";
}

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// What every figure says of how it was made.
Footer footer(const std::vector<Point>& points) {
  std::set<std::string> scenes;
  int least = points.front().runs;
  for (const Point& p : points) {
    scenes.insert(p.scene_hash);
    if (p.failure.empty()) least = std::min(least, p.runs);
  }
  const Point& p = points.front();
  return {p.machine + "; " + p.compiler,
          text("commit ", p.commit, "; at least ", least, least == 1 ? " run" : " runs", " a point; scene ", p.scene_hash,
               scenes.size() > 1 ? text(" and ", scenes.size() - 1, " more") : "")};
}

int ChartCommand::run() const {
  // What is missing is said before anything runs.
  if (auto found = find_gnuplot(); !found) return fail(found.error());
  Workshop workshop{.yardstick = references, .quick = quick};
  const std::vector<Study> all = studies(workshop);
  std::vector<Study> asked = all;
  if (!only.empty()) {
    std::string names;
    for (const Study& s : all) names += " " + s.name;
    std::erase_if(asked, [&](const Study& s) { return s.name != only; });
    if (asked.empty()) return fail({ErrorCode::invalid_argument, "--only", "is " + only + ", must be one of:" + names});
  }
  std::error_code error;
  fs::create_directories(out, error);
  if (error) return fail({ErrorCode::invalid_argument, "--out", "is " + out + ", which cannot be made: " + error.message()});

  RunOptions options{.points_file = fs::path(out) / "points.csv", .quick = quick};
  if (quick) options = {.points_file = options.points_file, .runs = 3, .seeds = 3, .enough_seconds = 0.4, .quick = true};
  auto points = run_studies(asked, options, workshop, show_progress);
  if (!points) return fail(points.error());

  // What was not run now is shown as it was measured last.
  const std::vector<Point> before = read_points(options.points_file);
  std::vector<Drawn> drawn;
  for (const Study& study : all) {
    Drawn d{&study, {}, ""};
    for (const Point& p : *points) {
      if (p.study == study.name) d.points.push_back(p);
    }
    if (d.points.empty()) d.points = newest_points(before, study);
    if (!d.points.empty()) {
      if (auto done = draw(figure(study, d.points, footer(d.points)), out, study.name); !done) return fail(done.error());
      d.svg = contents(fs::path(out) / (study.name + ".svg"));
    }
    drawn.push_back(std::move(d));
  }
  const std::string how = text(
      "Drawn on ", machine_name(), "; ", compiler_name(), "; commit ", commit(), ". Each figure names machine and commit of its own points. ",
      "Ten pinned runs of a point, twenty seeds of an ensemble; median and quartiles. Where a commit is marked quick: up to three repeats, three seeds, "
      "shorter scenes, the dear settings left out.");
  std::ofstream file(fs::path(out) / "index.html", std::ios::binary);
  file << page(drawn, not_built(), how);
  file.close();
  if (!file) return fail({ErrorCode::invalid_argument, "--out", "is " + out + ", where index.html cannot be written"});
  std::cout << Json{{"page", (fs::path(out) / "index.html").string()}, {"points", points->size()}}.dump() << "\n";
  return 0;
}

}  // namespace

void add_chart_command(CLI::App& app, int& exit_code) {
  auto command = std::make_shared<ChartCommand>();
  auto* c = app.add_subcommand("chart", "error against cost for every setting: a page, figures and points.csv; goes on where it was interrupted");
  c->add_option("--out", command->out, "folder for index.html, figures and points.csv")->required();
  c->add_option("--only", command->only, "run one study, by name; the page shows the others as they were measured last");
  c->add_option("--references", command->references, "folder of reference cases; what is not there is left out and said so")->capture_default_str();
  c->add_flag("--quick", command->quick, "under three minutes: fewer repeats, the dear settings left out");
  c->callback([command, &exit_code] { exit_code = command->run(); });
}

}  // namespace crumple::lab::chart
