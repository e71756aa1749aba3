#include "server/rig/show_command.h"

#include "server/io/mesh_file.h"
#include "server/io/write_file.h"
#include "server/rig/rig_picture.h"
#include "server/rig/rig_summary.h"

#include <iostream>

namespace crumple::rig {

void ShowCommand::add_to(CLI::App& app) {
  app.add_option("asset", asset, "an asset of crumple-rig")->required();
  app.add_option("--picture", picture, "a .png, or an .svg with names, of its handles and examples");
}

int ShowCommand::run() const {
  if (!picture.empty() && !io::has_ending(picture, {".png", ".svg"}))
    return fail(invalid("--picture", "is " + picture + ", must end in .png or .svg").error());
  const auto set = read_set(asset);
  if (!set) return fail(set.error(), asset);
  nlohmann::json result = summary(*set);
  if (!picture.empty()) {
    const std::string drawn = io::has_ending(picture, {".png"}) ? rig_png(*set) : rig_svg(*set);
    if (auto written = io::write_file(picture, drawn); !written) return fail(written.error());
    result["picture"] = picture;
  }
  std::cout << result.dump(2) << "\n";
  return 0;
}

}  // namespace crumple::rig
