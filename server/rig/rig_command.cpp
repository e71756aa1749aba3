#include "server/rig/rig_command.h"

#include "server/io/asset_file.h"
#include "server/io/mesh_file.h"

#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace crumple::rig {
namespace {

using sim::example_based::ExampleSet;

// The option that sets a field of the library's.
std::string option_of(const std::string& field) {
  constexpr std::pair<const char*, const char*> kOptions[] = {{"cell_size", "--cell-size"},
                                                              {"tet_budget", "--tets"},
                                                              {"automatic_handles", "--auto"},
                                                              {"weights", "--weights"},
                                                              {"painted_regions", "--regions"},
                                                              {"crush_depth", "--crush-depth"},
                                                              {"convex_parts", "--convex-parts"},
                                                              {"depth", "--depth"},
                                                              {"tolerance", "--tolerance"},
                                                              {"most_handles", "--most-handles"},
                                                              {"yield_strain", "--yield"},
                                                              {"pieces", "--pieces"},
                                                              {"size", "--size"},
                                                              {"aspect", "--aspect"},
                                                              {"direction", "--grain"},
                                                              {"block", "--block"},
                                                              {"planes", "--plane"},
                                                              {"strength", "--strength"},
                                                              {"density", "--density"},
                                                              {"least_part", "--least-part"}};
  for (const auto& [name, option] : kOptions)
    if (field == name) return option;
  return field;
}

}  // namespace

int fail(Error error, const std::string& file) {
  error.field = option_of(error.field);
  const std::string said = error.text();
  const bool named = file.empty() || said.find(std::filesystem::path(file).filename().string()) != std::string::npos;
  if (isatty(STDERR_FILENO) != 0) std::cerr << "\r\033[K";  // over the progress bar
  std::cerr << "crumple-rig: " << said << (named ? "" : " (" + file + ")") << "\n";
  return error.code == ErrorCode::invalid_argument || error.code == ErrorCode::not_found ? 2 : 1;
}

ProgressBar::ProgressBar() : terminal_(isatty(STDERR_FILENO) != 0) {}

void ProgressBar::show(double done, const std::string& stage) {
  if (!terminal_) return;
  const int filled = static_cast<int>(30 * done);
  std::fprintf(stderr, "\r\033[K[%s%s] %s%s", std::string(filled, '#').c_str(), std::string(30 - filled, '.').c_str(),
               stage.c_str(), done >= 1 ? "\n" : "");
}

void add_outputs(CLI::App& app, RigOutputs& outputs, const std::string& of_asset) {
  app.add_option("--out", outputs.asset, of_asset);
  app.add_option("--picture", outputs.picture,
                 "a .png, or an .svg with names, of the rest shape, its handles and each example");
  app.add_option("--scene", outputs.scene, "a .json scene that drops the asset; the asset lies in its folder or below");
  app.add_option("--gltf", outputs.gltf,
                 "a .glb of surface, skin with the top eight weights, examples as animations, regions as colours");
}

Result<ExampleSet> read_set(const std::string& file) {
  auto asset = io::read_asset(file);
  if (!asset) return std::unexpected(asset.error());
  if (auto* set = std::get_if<ExampleSet>(&asset->content)) return std::move(*set);
  return invalid(file, "holds another kind of asset, must hold an example set");
}

bool is_asset(const std::string& file) { return io::has_ending(file, {".crumple-asset", ".json"}); }

}  // namespace crumple::rig
