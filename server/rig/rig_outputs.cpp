#include "server/rig/rig_outputs.h"

#include "common/text.h"
#include "server/io/asset_file.h"
#include "server/io/gltf_export.h"
#include "server/io/mesh_file.h"
#include "server/io/side_files.h"
#include "server/io/write_file.h"
#include "server/rig/drop_scene.h"
#include "server/rig/rig_picture.h"

namespace crumple::rig {

Result<void> check_apart(const std::vector<std::string>& inputs,
                         const std::vector<std::pair<std::string, std::string>>& outputs) {
  std::vector<std::filesystem::path> taken;
  const auto place = [](const std::string& file) {
    std::error_code failure;
    const auto whole = std::filesystem::weakly_canonical(std::filesystem::absolute(file, failure), failure);
    return failure ? std::filesystem::path(file) : whole;
  };
  for (const std::string& file : inputs)
    if (!file.empty()) taken.push_back(place(file));
  for (const auto& [option, file] : outputs) {
    if (file.empty()) continue;
    if (std::ranges::find(taken, place(file)) != taken.end())
      return invalid(option, "is " + file + ", must be no file that is read or written besides");
    taken.push_back(place(file));
  }
  return {};
}

Result<void> RigOutputs::check(const std::vector<std::string>& inputs) const {
  if (!io::has_ending(asset, {".crumple-asset", ".json"}))
    return invalid("--out", "is " + asset + ", must end in .crumple-asset or .json");
  if (!picture.empty() && !io::has_ending(picture, {".png", ".svg"}))
    return invalid("--picture", "is " + picture + ", must end in .png or .svg");
  if (!scene.empty() && !io::has_ending(scene, {".json"}))
    return invalid("--scene", "is " + scene + ", must end in .json");
  if (!gltf.empty() && !io::has_ending(gltf, {".glb"})) return invalid("--gltf", "is " + gltf + ", must end in .glb");
  if (auto apart =
          check_apart(inputs, {{"--out", asset}, {"--picture", picture}, {"--scene", scene}, {"--gltf", gltf}});
      !apart)
    return apart;
  return scene.empty() ? Result<void>() : scene_can_name(asset, scene);
}

Result<void> RigOutputs::write(const sim::example_based::ExampleSet& set, nlohmann::json& result) const {
  const auto put = [&](const char* name, const std::string& file, const std::string& content) {
    result[name] = file;
    return io::write_file(file, content);
  };
  if (auto written = io::write_asset({std::filesystem::path(asset).stem().string(), set}, asset); !written)
    return written;
  result["asset"] = asset;
  if (!picture.empty()) {
    const std::string content = io::has_ending(picture, {".png"}) ? rig_png(set) : rig_svg(set);
    if (auto written = put("picture", picture, content); !written) return written;
  }
  if (!scene.empty()) {
    const auto content = drop_scene(set, asset, scene);
    if (!content) return std::unexpected(content.error());
    if (auto written = put("scene", scene, *content); !written) return written;
  }
  if (!gltf.empty()) {
    std::vector<std::string> notes;
    const auto content = io::gltf_of(set, notes);
    if (!content) return std::unexpected(content.error());
    if (auto written = put("gltf", gltf, *content); !written) return written;
    for (const auto& note : notes) result["warnings"].push_back(note);
  }
  return {};
}

}  // namespace crumple::rig
