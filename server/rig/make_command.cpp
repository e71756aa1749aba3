#include "server/rig/make_command.h"

#include "server/io/rig_import.h"
#include "server/rig/rig_files.h"
#include "server/rig/rig_summary.h"

#include <iostream>

namespace crumple::rig {

void MakeCommand::add_to(CLI::App& app) {
  app.add_option("--cell-size", options.enclosing.cell_size,
                 "edge of a lattice cell [m]; default: the finest within --tets");
  app.add_option("--tets", options.enclosing.tet_budget, "at most so many tets")->capture_default_str();
  app.add_flag("--keep-lattice", options.keep_lattice, "tets as they enclose the surface, not drawn onto it");
  app.add_option("--handles", handles,
                 "JSON file of points, bones and cages (docs/rigging.md), beside the mesh's joints");
  app.add_option("--joints", joints, "what a skin's joints are to computed weights: points, or bones to their children")
      ->check(CLI::IsMember({"points", "bones"}))
      ->capture_default_str();
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
  app.add_option("--crushed", crushed, "a crushed pose for each side of the box; auto: where there is no other example")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->capture_default_str();
  app.add_option("--crush-depth", options.crush_depth, "of these, as a part of the extent")->capture_default_str();
  app.add_option("--convex-parts", options.convex_parts,
                 "collision parts along the longest axis; default: by its proportions");
}

Result<authoring::RiggedAsset> MakeCommand::make(ProgressBar& progress) {
  using Crushed = authoring::RigOptions::Crushed;
  options.crushed = crushed == "always"  ? Crushed::always
                    : crushed == "never" ? Crushed::never
                                         : Crushed::where_no_other;
  using Joints = authoring::RigOptions::Joints;
  options.joints = joints == "bones" ? Joints::bones : Joints::points;
  using Weights = authoring::RigOptions::Weights;
  options.weights = weights == "painted"      ? Weights::painted
                    : weights == "biharmonic" ? Weights::bounded_biharmonic
                    : weights == "gaussian"   ? Weights::gaussian
                                              : Weights::by_mesh;
  progress.show(0, "reading " + mesh);
  const auto artist = io::import_artist_mesh(mesh, turn_only ? io::ScaledJoints::turn_only : io::ScaledJoints::reject);
  if (!artist) return std::unexpected(artist.error());
  if (!handles.empty()) {
    auto list = read_handles(handles);
    if (!list) return std::unexpected(list.error());
    options.handles = *std::move(list);
  }
  if (!poses.empty()) {
    auto list = read_poses(poses);
    if (!list) return std::unexpected(list.error());
    options.poses = *std::move(list);
  }
  auto made = authoring::make_asset(*artist, options,
                                    [&](double done, const std::string& stage) { progress.show(done, stage); });
  if (made && !options.painted_regions && artist->colours.size() == artist->surface.vertices.size())
    made->report.warnings.push_back("the mesh has vertex colours, which are not looked at without --regions");
  return made;
}

Result<sim::example_based::ExampleSet> MakeCommand::read_or_make(ProgressBar& progress, bool without_crushed,
                                                                 nlohmann::json& result) {
  if (is_asset(mesh)) return read_set(mesh);
  if (without_crushed && crushed == "auto") crushed = "never";
  auto made = make(progress);
  if (!made) return std::unexpected(made.error());
  result = summary(made->report);
  return std::move(made->set);
}

int MakeCommand::run(const RigOutputs& outputs) {
  if (mesh.empty()) return fail(invalid("mesh", "is missing, must be a mesh file (see --help)").error());
  if (auto valid = outputs.check({mesh, handles, poses}); !valid) return fail(valid.error());
  ProgressBar progress;
  const auto made = make(progress);
  if (!made) return fail(made.error(), mesh);
  nlohmann::json result = summary(made->report);
  if (auto written = outputs.write(made->set, result); !written) return fail(written.error());
  std::cout << result.dump(2) << "\n";
  return 0;
}

}  // namespace crumple::rig
