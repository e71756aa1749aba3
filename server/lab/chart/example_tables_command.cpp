#include "server/lab/chart/example_tables_command.h"

#include "common/text.h"
#include "server/io/write_file.h"
#include "server/lab/chart/example_tables.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/command_output.h"
#include "server/lab/destruction_scenes.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

namespace crumple::lab::chart {
namespace {

struct TablesCommand {
  std::vector<std::string> scenes{"dock", "pachinko", "driver", "pileup", "cannonballs", "space", "shipyard", "pegs"};
  std::string out, page, figure = "pachinko";
  ExampleTimesOptions options;

  Result<Json> run() const {
    std::string old_page;
    if (!page.empty()) {
      std::ifstream file(page);
      old_page.assign(std::istreambuf_iterator<char>(file), {});
      if (auto fits = with_tables(old_page, ""); !fits) return std::unexpected(fits.error());
    }
    const bool draws = std::ranges::find(scenes, figure) != scenes.end();
    if (draws)
      if (auto found = find_gnuplot(); !found) return std::unexpected(found.error());
    const auto made = make_out_folder(out);
    if (!made) return std::unexpected(made.error());
    const std::filesystem::path& folder = *made;

    const std::string made_on = text(machine_name(), "; ", compiler_name(), "; commit ", commit(), "; ", options.threads,
                                     options.threads == 1 ? " thread" : " threads", ", medians of ", options.repeats, " runs");
    std::vector<SceneTimes> times;
    for (const std::string& scene : scenes) {
      auto timed = time_example_scene(scene, options, [&](int done, int all) {
        if (isatty(STDERR_FILENO)) std::cerr << "\r" << scene << ": run " << done << " of " << all << (done == all ? "\n" : "") << std::flush;
      });
      if (!timed) return std::unexpected(timed.error());
      times.push_back(*std::move(timed));
    }
    const std::string tables = example_tables_markdown(times, made_on);
    if (auto written = io::write_file(folder / "examples.md", tables); !written) return std::unexpected(written.error());
    if (auto written = io::write_file(folder / "examples.csv", example_tables_csv(times)); !written) return std::unexpected(written.error());
    Json result{{"tables", (folder / "examples.md").string()}, {"csv", (folder / "examples.csv").string()}};
    if (draws) {
      const auto& scene = *std::ranges::find(times, figure, &SceneTimes::name);
      if (auto drawn = draw(frame_figure(scene, made_on), folder, "examples-" + figure); !drawn) return std::unexpected(drawn.error());
      result["picture"] = (folder / ("examples-" + figure + ".png")).string();
    }
    if (!page.empty()) {
      if (auto written = io::write_file(page, *with_tables(old_page, tables)); !written) return std::unexpected(written.error());
      result["page"] = page;
    }
    return result;
  }
};

}  // namespace

void add_example_tables_command(CLI::App& app, int& exit_code) {
  auto command = std::make_shared<TablesCommand>();
  auto* t = app.add_subcommand("tables", "tables 1 and 2 and figure 11 of Jones et al. 2016 for our scenes, as Markdown, CSV and a figure");
  t->add_option("--out", command->out, "folder for examples.md, examples.csv and examples-SCENE.png and .svg")->required();
  t->add_option("--page", command->page, "a Markdown page whose tables are replaced, such as docs/example-scenes.md")->check(CLI::ExistingFile);
  std::vector<std::string> known;
  for (const auto& [name, steps] : destruction_steps()) known.push_back(name);
  t->add_option("--scenes", command->scenes, "some of them: dock,driver")->delimiter(',')->check(CLI::IsMember(known));
  t->add_option("--figure", command->figure, "the scene that is drawn frame by frame, if it is among them")->check(CLI::IsMember(known))->capture_default_str();
  t->add_option("--threads", command->options.threads)->check(CLI::Range(1, 256))->capture_default_str();
  t->add_option("--repeats", command->options.repeats, "runs of each; a step's time is their median")->check(CLI::Range(1, 100))->capture_default_str();
  t->add_option("--steps", command->options.steps, "of each run; default: as long as things happen")->check(CLI::Range(1, 1'000'000));
  t->callback([command, &exit_code] { exit_code = print_outcome(command->run()); });
}

}  // namespace crumple::lab::chart
