// crumple-rig: from an artist's mesh to an example-based asset (Jones et al. 2016, section 4).
// Exit: 0 done; 2 bad input; 1 anything else.
#include "server/io/asset_file.h"
#include "server/io/mesh_file.h"
#include "server/io/rig_import.h"
#include "server/rig/crush.h"
#include "server/rig/rig_files.h"
#include "server/rig/rig_outputs.h"
#include "server/rig/rig_summary.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <string>

using namespace crumple;
using nlohmann::json;
using sim::example_based::ExampleSet;

namespace {

// The option that sets a field of the library's.
std::string option_of(const std::string& field) {
  constexpr std::pair<const char*, const char*> kOptions[] = {
      {"cell_size", "--cell-size"},       {"tet_budget", "--tets"},
      {"automatic_handles", "--auto"},    {"weights", "--weights"},
      {"painted_regions", "--regions"},   {"crush_depth", "--crush-depth"},
      {"convex_parts", "--convex-parts"}, {"depth", "--depth"},
      {"tolerance", "--tolerance"},       {"most_handles", "--most-handles"},
      {"yield_strain", "--yield"}};
  for (const auto& [name, option] : kOptions)
    if (field == name) return option;
  return field;
}

int fail(Error error, const std::string& file = "") {
  error.field = option_of(error.field);
  const std::string said = error.text();
  const bool named = file.empty() || said.find(std::filesystem::path(file).filename().string()) != std::string::npos;
  std::cerr << "crumple-rig: " << said << (named ? "" : " (" + file + ")") << "\n";
  return error.code == ErrorCode::invalid_argument || error.code == ErrorCode::not_found ? 2 : 1;
}

// "[######..............] fitting dented", redrawn in place; on a terminal only.
class ProgressBar {
 public:
  void show(double done, const std::string& stage) {
    if (!terminal_) return;
    const int filled = static_cast<int>(30 * done);
    std::fprintf(stderr, "\r\033[K[%s%s] %s%s", std::string(filled, '#').c_str(), std::string(30 - filled, '.').c_str(),
                 stage.c_str(), done >= 1 ? "\n" : "");
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
};

void add_outputs(CLI::App& app, rig::RigOutputs& outputs, const std::string& of_asset) {
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

// What makes an asset of a mesh.
struct MakeCommand {
  std::string mesh, handles, poses, crushed = "auto", weights = "auto";
  authoring::RigOptions options;
  bool turn_only = false;

  void add_to(CLI::App& app) {
    app.add_option("--cell-size", options.enclosing.cell_size,
                   "edge of a lattice cell [m]; default: the finest within --tets");
    app.add_option("--tets", options.enclosing.tet_budget, "at most so many tets")->capture_default_str();
    app.add_flag("--keep-lattice", options.keep_lattice, "tets as they enclose the surface, not drawn onto it");
    app.add_option("--handles", handles, "JSON file of a HandleList (docs/rigging.md), beside the mesh's joints");
    app.add_option("--auto", options.automatic_handles,
                   "handles added on the surface; default: 24 where there is no other, else 0")
        ->check(CLI::Range(0, 1024));
    app.add_option("--weights", weights,
                   "painted: the mesh's own joint weights; biharmonic: bounded, of the tets' shape; gaussian: of "
                   "distance; auto: painted where the mesh has them and no handle is added, else biharmonic")
        ->check(CLI::IsMember({"auto", "painted", "biharmonic", "gaussian"}))
        ->capture_default_str();
    app.add_option("--tolerance", options.tolerance,
                   "handles are added until each morph target is met to this part of its displacement, (0, 1]");
    app.add_option("--most-handles", options.most_handles, "of all handles, with --tolerance")->capture_default_str();
    app.add_flag("--regions", options.painted_regions, "vertex colours scale alpha (red) and beta (blue)");
    app.add_flag("--turn-only", turn_only,
                 "joints that an animation scales are turned only, with a warning; default: an error");
    app.add_option("--poses", poses, "JSON file of a PoseList: examples by moved handles");
    app.add_option("--crushed", crushed,
                   "a crushed pose for each side of the box; auto: where there is no other example")
        ->check(CLI::IsMember({"auto", "always", "never"}))
        ->capture_default_str();
    app.add_option("--crush-depth", options.crush_depth, "of these, as a part of the extent")->capture_default_str();
    app.add_option("--convex-parts", options.convex_parts,
                   "collision parts along the longest axis; default: by its proportions");
  }

  Result<authoring::RiggedAsset> make(ProgressBar& progress) {
    using Crushed = authoring::RigOptions::Crushed;
    options.crushed = crushed == "always"  ? Crushed::always
                      : crushed == "never" ? Crushed::never
                                           : Crushed::where_no_other;
    using Weights = authoring::RigOptions::Weights;
    options.weights = weights == "painted"      ? Weights::painted
                      : weights == "biharmonic" ? Weights::bounded_biharmonic
                      : weights == "gaussian"   ? Weights::gaussian
                                                : Weights::by_mesh;
    progress.show(0, "reading " + mesh);
    const auto artist =
        io::import_artist_mesh(mesh, turn_only ? io::ScaledJoints::turn_only : io::ScaledJoints::reject);
    if (!artist) return std::unexpected(artist.error());
    if (!handles.empty()) {
      auto list = rig::read_handles(handles);
      if (!list) return std::unexpected(list.error());
      options.handles = *std::move(list);
    }
    if (!poses.empty()) {
      auto list = rig::read_poses(poses);
      if (!list) return std::unexpected(list.error());
      options.poses = *std::move(list);
    }
    auto made = authoring::make_asset(*artist, options,
                                      [&](double done, const std::string& stage) { progress.show(done, stage); });
    if (made && !options.painted_regions && artist->colours.size() == artist->surface.vertices.size())
      made->report.warnings.push_back("the mesh has vertex colours, which are not looked at without --regions");
    return made;
  }

  int run(const rig::RigOutputs& outputs) {
    if (mesh.empty()) return fail(invalid("mesh", "is missing, must be a mesh file (see --help)").error());
    if (auto valid = outputs.check({mesh, handles, poses}); !valid) return fail(valid.error());
    ProgressBar progress;
    const auto made = make(progress);
    if (!made) return fail(made.error(), mesh);
    json result = rig::summary(made->report);
    if (auto written = outputs.write(made->set, result); !written) return fail(written.error());
    std::cout << result.dump(2) << "\n";
    return 0;
  }
};

struct PoseCommand {
  std::string asset, name;
  std::vector<std::tuple<std::string, double, double, double>> moves, turns;
  bool hold = false;

  void add_to(CLI::App& app) {
    app.add_option("asset", asset, "an asset of crumple-rig")->required();
    app.add_option("--name", name, "of the new example")->required();
    app.add_option("--handle", moves,
                   "NAME X Y Z: where a handle goes [m]; again for the next one. How it "
                   "turns, and what handles do that are not named, keeps the body as rigid as possible");
    app.add_option("--turn", turns, "NAME X Y Z: how it turns, axis times angle [degrees]; 0 0 0: not at all");
    app.add_flag("--hold", hold, "handles that are not named stay as they are at rest");
  }

  int run(rig::RigOutputs outputs) const {
    if (outputs.asset.empty()) outputs.asset = asset;
    if (auto valid = outputs.check({}); !valid) return fail(valid.error());
    auto set = read_set(asset);
    if (!set) return fail(set.error(), asset);
    authoring::NamedPose pose{name, {}};
    const auto move_of = [&](const std::string& handle) -> authoring::HandleMove& {
      const auto at = std::ranges::find(pose.moves, handle, &authoring::HandleMove::handle);
      if (at != pose.moves.end()) return *at;
      return pose.moves.emplace_back(authoring::HandleMove{.handle = handle, .position = {}, .rotation = {}});
    };
    for (const auto& [handle, x, y, z] : moves) {
      auto& move = move_of(handle);
      if (move.position) return fail(invalid("--handle", "\"" + handle + "\" is moved twice").error());
      move.position = Vec3(x, y, z);
    }
    for (const auto& [handle, x, y, z] : turns) {
      const Vec3 turn = Vec3(x, y, z) * (M_PI / 180);
      move_of(handle).rotation =
          turn.norm() > 0 ? Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) : Quat::Identity();
    }
    if (pose.moves.empty())
      return fail(invalid("--handle", "is missing, must name a handle and where it goes").error());
    using authoring::UnnamedHandles;
    const auto added =
        authoring::ExampleAuthor(*set).add_pose(pose, hold ? UnnamedHandles::held : UnnamedHandles::free);
    if (!added) return fail(added.error(), asset);
    json result = rig::summary(*set);
    result["posed"] = rig::summary(*added);
    if (auto written = outputs.write(*set, result); !written) return fail(written.error());
    std::cout << result.dump(2) << "\n";
    return 0;
  }
};

struct CrushCommand {
  std::vector<std::string> sides{"+x"};
  std::string name;
  rig::CrushOptions options;
  MakeCommand make;

  void add_to(CLI::App& app) {
    app.add_option("mesh", make.mesh, "a mesh file, or an asset of crumple-rig (.crumple-asset, .json)")->required();
    app.add_option("--side", sides, "that is pressed in; several: +x,-x,+y")
        ->delimiter(',')
        ->check(CLI::IsMember({"+x", "-x", "+y", "-y", "+z", "-z"}))
        ->capture_default_str();
    app.add_option("--depth", options.depth, "as a part of the extent, (0, 0.6]")->capture_default_str();
    app.add_option("--yield", options.yield_strain, "elastic strain at which it flows, [1e-4, 1]")
        ->capture_default_str();
    app.add_option("--threads", options.threads, "the result does not depend on it")
        ->check(CLI::Range(1, 256))
        ->capture_default_str();
    app.add_option("--name", name, "of the example; default: pressed and the side");
    make.add_to(app);
  }

  int run(rig::RigOutputs outputs) {
    ProgressBar progress;
    const bool is_asset = io::has_ending(make.mesh, {".crumple-asset", ".json"});
    if (outputs.asset.empty() && is_asset) outputs.asset = make.mesh;
    if (outputs.asset.empty()) return fail(invalid("--out", "is missing, must name the asset file").error());
    const std::string mesh = is_asset ? "" : make.mesh;
    if (auto valid = outputs.check({mesh, make.handles, make.poses}); !valid) return fail(valid.error());
    json result;
    ExampleSet set;
    if (is_asset) {
      auto read = read_set(make.mesh);
      if (!read) return fail(read.error(), make.mesh);
      set = *std::move(read);
    } else {
      if (make.crushed == "auto") make.crushed = "never";  // there will be an example
      auto made = make.make(progress);
      if (!made) return fail(made.error(), make.mesh);
      set = std::move(made->set);
      result = rig::summary(made->report);
    }
    result["crushed"] = json::array();
    authoring::ExampleAuthor author(set);
    for (const std::string& side : sides) {
      options.from_max = side[0] == '+';
      options.axis = side[1] - 'x';
      const std::string example = name.empty() ? "pressed " + side : sides.size() > 1 ? name + " " + side : name;
      const auto crushed =
          rig::crush(set, example, options, [&](double done) { progress.show(done, "pressing " + side); });
      if (!crushed) return fail(crushed.error(), make.mesh);
      const auto fitted = author.add_copy(crushed->copy);
      if (!fitted) return fail(fitted.error(), make.mesh);
      json one = rig::summary(*fitted);
      one["thickness"] = crushed->report.thickness;
      one["plastic_strain_largest"] = crushed->report.plastic_strain;
      one["inverted_tets"] = crushed->report.inverted_tets;
      result["crushed"].push_back(one);
    }
    if (auto written = outputs.write(set, result); !written) return fail(written.error());
    std::cout << result.dump(2) << "\n";
    return 0;
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Makes an example-based asset of a mesh (OBJ, glTF, PLY, STL, OFF, FBX): encloses it in tets, places handles, "
      "weighs\n"
      "them, takes example poses from animations, morph targets, files or sides pressed in. Prints one JSON object.\n"
      "crumple-rig MESH --out ASSET; the commands below go on from there. Exit 0: done, 2: bad input, 1: anything "
      "else."};
  app.require_subcommand(0, 1);
  MakeCommand make;
  rig::RigOutputs outputs, pose_outputs, crush_outputs;
  app.add_option("mesh", make.mesh, "the artist's mesh");
  make.add_to(app);
  add_outputs(app, outputs, "the asset file, required: .crumple-asset, or JSON if it ends in .json");

  PoseCommand pose;
  auto* p = app.add_subcommand("pose", "adds an example by moving handles of an asset");
  pose.add_to(*p);
  add_outputs(*p, pose_outputs, "another asset file; default: the same");

  CrushCommand crush;
  auto* c = app.add_subcommand("crush", "adds examples by pressing sides in, simulated by finite elements");
  crush.add_to(*c);
  add_outputs(*c, crush_outputs, "the asset file; default: the same, where an asset is given");

  std::string shown;
  auto* s = app.add_subcommand("show", "prints an asset's handles and examples");
  s->add_option("asset", shown)->required();

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (p->parsed()) return pose.run(pose_outputs);
  if (c->parsed()) return crush.run(crush_outputs);
  if (s->parsed()) {
    const auto set = read_set(shown);
    if (!set) return fail(set.error(), shown);
    std::cout << rig::summary(*set).dump(2) << "\n";
    return 0;
  }
  if (outputs.asset.empty()) return fail(invalid("--out", "is missing, must name the asset file").error());
  return make.run(outputs);
}
