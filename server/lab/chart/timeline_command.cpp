#include "server/lab/chart/timeline_command.h"

#include "common/text.h"
#include "server/io/scene_file.h"
#include "server/io/write_file.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/chart/timeline.h"
#include "server/lab/command_output.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>

namespace crumple::lab::chart {
namespace {

struct TimelineCommand {
  std::string scene, out;
  TimelineOptions options;

  Result<nlohmann::json> run() const {
    if (auto found = find_gnuplot(); !found) return std::unexpected(found.error());
    const auto loaded = io::load_scene(scene);
    if (!loaded) return std::unexpected(loaded.error());
    const auto made = make_out_folder(out);
    if (!made) return std::unexpected(made.error());
    const std::filesystem::path& folder = *made;
    const auto timeline = run_timeline(loaded->scene, options, [&](int done, int all) {
      if (isatty(STDERR_FILENO)) std::cerr << "\r" << scene << ": run " << done << " of " << all << (done == all ? "\n" : "") << std::flush;
    });
    if (!timeline) return std::unexpected(timeline.error());
    const std::string name = std::filesystem::path(scene).stem().string();
    if (auto written = io::write_file(folder / ("timeline-" + name + ".csv"), timeline_csv(*timeline)); !written)
      return std::unexpected(written.error());
    const std::string made_on = text(machine_name(), "; ", compiler_name(), "; commit ", commit(), "; medians of ", options.repeats, " runs");
    if (auto drawn = draw(timeline_figure(*timeline, name, made_on), folder, "timeline-" + name); !drawn) return std::unexpected(drawn.error());
    nlohmann::json result{{"picture", (folder / ("timeline-" + name + ".png")).string()}, {"state_hash", text(std::hex, timeline->state_hash)}};
    for (std::size_t i = 0; i < timeline->threads.size(); ++i) {
      double sum = 0;
      for (const double ms : timeline->ms[i]) sum += ms;
      result["ms_per_step"][std::to_string(timeline->threads[i])] = {{"mean", sum / static_cast<double>(timeline->ms[i].size())},
                                                                     {"worst", *std::ranges::max_element(timeline->ms[i])}};
    }
    return result;
  }
};

}  // namespace

void add_timeline_command(CLI::App& app, int& exit_code) {
  auto command = std::make_shared<TimelineCommand>();
  auto* t = app.add_subcommand("timeline", "a scene step by step: time by number of threads, its parts, and the workload, as a figure and a table");
  t->add_option("scene", command->scene, "a scene file")->required();
  t->add_option("--out", command->out, "folder for timeline-SCENE.png, .svg and .csv")->required();
  t->add_option("--steps", command->options.steps)->check(CLI::Range(1, 1'000'000))->capture_default_str();
  t->add_option("--threads", command->options.threads, "numbers of threads, such as 1,2")->delimiter(',')->check(CLI::Range(1, 256))->capture_default_str();
  t->add_option("--repeats", command->options.repeats, "runs of each; a step's time is their median")->check(CLI::Range(1, 100))->capture_default_str();
  t->callback([command, &exit_code] { exit_code = print_outcome(command->run()); });
}

}  // namespace crumple::lab::chart
