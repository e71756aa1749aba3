#include "server/rig/break_command.h"

#include "common/text.h"
#include "server/io/asset_file.h"
#include "server/io/mesh_file.h"
#include "server/io/write_file.h"
#include "server/rig/parts_picture.h"

#include <iostream>

namespace crumple::rig {
namespace {

using authoring::ScoreOptions;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr std::pair<const char*, ScoreOptions::By> kBy[] = {
    {"planes", ScoreOptions::By::planes}, {"voronoi", ScoreOptions::By::voronoi}, {"bricks", ScoreOptions::By::bricks},
    {"wood", ScoreOptions::By::wood},     {"stone", ScoreOptions::By::stone},     {"glass", ScoreOptions::By::glass}};

// "wall_parts/12.crumple-asset", beside the scene.
std::string part_file(const fs::path& scene, std::size_t part) {
  return scene.stem().string() + "_parts/" + text(part + 1) + ".crumple-asset";
}

}  // namespace

void BreakCommand::add_to(CLI::App& app) {
  app.add_option("mesh", make.mesh, "an asset of crumple-rig (.crumple-asset, .json), or a mesh file")->required();
  app.add_option("--out", scene,
                 "the .json scene of the parts, required; they are put into a folder beside it, NAME_parts");
  app.add_option("--picture", picture, "a .png or .svg of the parts, together and apart");
  app.add_option("--by", by, "how it is scored")
      ->check(CLI::IsMember({"planes", "voronoi", "bricks", "wood", "stone", "glass"}))
      ->capture_default_str();
  app.add_option(
      "--plane", planes,
      "NX NY NZ D: a plane of points p with n . p = D [m], n of length 1 once scaled; again for the next one. "
      "Default: --pieces slabs of the longest side");
  app.add_option("--pieces", score.pieces, "Voronoi cells, or slabs, [2, 1000]")->capture_default_str();
  app.add_option("--size", score.size,
                 "of bricks, stones, shards, or slivers' widths [m]; default: by the body's size");
  app.add_option("--block", block, "X Y Z: of a brick [m]; default: --size, and half of it")->expected(3);
  app.add_option("--grain", grain, "X Y Z: of wood; default: along the longest side")->expected(3);
  app.add_option("--aspect", score.aspect, "of wood: a sliver's length over its width")->capture_default_str();
  app.add_option("--seed", score.seed, "of what is random")->capture_default_str();
  app.add_option("--least-part", prescoring.least_part, "smaller ones, in parts of the mean, join a neighbour, [0, 1)")
      ->capture_default_str();
  app.add_option("--strength", options.strength,
                 "tension that shared faces bear [Pa]; default: 100 times its own weight's pressure");
  app.add_option("--density", options.density, "[kg/m^3]")->capture_default_str();
  app.add_flag("--unstruck", unstruck, "no ball in the scene");
  make.add_to(app);
}

int BreakCommand::run() {
  if (scene.empty()) return fail(invalid("--out", "is missing, must name the scene file").error());
  if (!io::has_ending(scene, {".json"})) return fail(invalid("--out", "is " + scene + ", must end in .json").error());
  if (!picture.empty() && !io::has_ending(picture, {".png", ".svg"}))
    return fail(invalid("--picture", "is " + picture + ", must end in .png or .svg").error());
  const std::vector<std::string> inputs{make.mesh, make.handles, make.poses};
  if (auto apart = check_apart(inputs, {{"--out", scene}, {"--picture", picture}}); !apart) return fail(apart.error());
  for (const auto& [name, kind] : kBy)
    if (by == name) score.by = kind;
  for (const auto& [x, y, z, offset] : planes) {
    const Vec3 normal(x, y, z);
    score.planes.push_back({normal, offset});
  }
  if (grain.size() == 3) score.direction = Vec3(grain[0], grain[1], grain[2]);
  if (block.size() == 3) score.block = Vec3(block[0], block[1], block[2]);
  options.struck = !unstruck;

  ProgressBar progress;
  json result;
  const auto set = make.read_or_make(progress, false, result);
  if (!set) return fail(set.error(), make.mesh);
  progress.show(0, "scoring");
  const auto cells = authoring::scored_cells(*set, score);
  if (!cells) return fail(cells.error(), make.mesh);
  progress.show(0.1, text("cutting along ", cells->size(), " cells"));
  const auto broken = authoring::prescored_parts(*set, *cells, prescoring);
  if (!broken) return fail(broken.error(), make.mesh);
  if (broken->parts.size() > static_cast<std::size_t>(authoring::kMostPieces))
    return fail(invalid("--size", text("makes ", broken->parts.size(), " parts, must make at most ",
                                       authoring::kMostPieces, ": larger ones"))
                    .error());

  const fs::path folder = fs::path(scene).parent_path();
  std::vector<std::string> files;
  for (std::size_t p = 0; p < broken->parts.size(); ++p) files.push_back(part_file(scene, p));
  const auto content = broken_scene(*broken, files, fs::path(scene).stem().string(), options);
  if (!content) return fail(content.error());
  for (const std::string& file : files)
    if (auto apart = check_apart(inputs, {{"--out", (folder / file).string()}}); !apart) return fail(apart.error());
  std::error_code failure;
  fs::create_directories((folder / files.front()).parent_path(), failure);
  if (failure)
    return fail({ErrorCode::unavailable, (folder / files.front()).parent_path().string(),
                 "cannot be made: " + failure.message()});
  result["parts"] = json::array();
  for (std::size_t p = 0; p < files.size(); ++p) {
    const auto& part = broken->parts[p];
    progress.show(0.6 + 0.4 * static_cast<double>(p) / static_cast<double>(files.size()), "writing " + files[p]);
    const std::string file = (folder / files[p]).string();
    if (auto written = io::write_asset({text(fs::path(scene).stem().string(), " part ", p + 1), part.set}, file);
        !written)
      return fail(written.error());
    result["parts"].push_back(
        {{"asset", file}, {"volume", part.volume}, {"tets", part.set.mesh.tet_count()}, {"bones", part.bones.size()}});
  }
  if (auto written = io::write_file(scene, *content); !written) return fail(written.error());
  result["scene"] = scene;
  result["joints"] = broken->faces.size();
  result["strength"] = options.strength > 0 ? options.strength : default_strength(*broken, options.density);
  if (!picture.empty()) {
    const std::string drawn = io::has_ending(picture, {".png"}) ? parts_png(*broken) : parts_svg(*broken);
    if (auto written = io::write_file(picture, drawn); !written) return fail(written.error());
    result["picture"] = picture;
  }
  if (broken->faces.empty()) result["warnings"].push_back("no two parts lie against each other: there are no joints");
  progress.show(1, "done");
  std::cout << result.dump(2) << "\n";
  return 0;
}

}  // namespace crumple::rig
