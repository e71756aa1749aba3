#include "server/rig/crush_command.h"

#include "server/rig/rig_summary.h"
#include "server/rig/shell_crush.h"

#include <iostream>

namespace crumple::rig {

using nlohmann::json;

void CrushCommand::add_to(CLI::App& app) {
  app.add_option("mesh", make.mesh, "a mesh file, or an asset of crumple-rig (.crumple-asset, .json)")->required();
  app.add_option("--side", sides, "that is pressed in; several: +x,-x,+y")
      ->delimiter(',')
      ->check(CLI::IsMember({"+x", "-x", "+y", "-y", "+z", "-z"}))
      ->capture_default_str();
  app.add_option("--depth", options.depth, "as a part of the extent, (0, 0.6]")->capture_default_str();
  app.add_option("--yield", options.yield_strain, "elastic strain at which it flows, [1e-4, 1]")->capture_default_str();
  app.add_flag(
      "--shell", shell,
      "its skin alone, as a thin shell of masses and springs, which buckles; default: filled, by finite elements");
  app.add_option("--threads", options.threads, "the result does not depend on it")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--name", name, "of the example; default: pressed and the side");
  make.add_to(app);
}

int CrushCommand::run(RigOutputs outputs) {
  ProgressBar progress;
  const bool in_place = is_asset(make.mesh);
  if (outputs.asset.empty() && in_place) outputs.asset = make.mesh;
  if (outputs.asset.empty()) return fail(invalid("--out", "is missing, must name the asset file").error());
  if (auto valid = outputs.check({in_place ? "" : make.mesh, make.handles, make.poses}); !valid)
    return fail(valid.error());
  json result;
  auto read = make.read_or_make(progress, true, result);
  if (!read) return fail(read.error(), make.mesh);
  sim::example_based::ExampleSet& set = *read;
  result["crushed"] = json::array();
  authoring::ExampleAuthor author(set);
  for (const std::string& side : sides) {
    options.from_max = side[0] == '+';
    options.axis = side[1] - 'x';
    const auto press = shell ? shell_crush : crush;
    const std::string example = name.empty() ? "pressed " + side : sides.size() > 1 ? name + " " + side : name;
    const auto crushed = press(set, example, options, [&](double done) { progress.show(done, "pressing " + side); });
    if (!crushed) return fail(crushed.error(), make.mesh);
    const auto fitted = author.add_copy(crushed->copy);
    if (!fitted) return fail(fitted.error(), make.mesh);
    json one = summary(*fitted);
    one["thickness"] = crushed->report.thickness;
    one["plastic_strain_largest"] = crushed->report.plastic_strain;
    if (!shell) one["inverted_tets"] = crushed->report.inverted_tets;
    result["crushed"].push_back(one);
  }
  if (auto written = outputs.write(set, result); !written) return fail(written.error());
  std::cout << result.dump(2) << "\n";
  return 0;
}

}  // namespace crumple::rig
