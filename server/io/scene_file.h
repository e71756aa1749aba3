#pragma once

#include "common/error.h"
#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/recording_convert.h"
#include "server/sim/scene.h"

#include <filesystem>
#include <string>
#include <vector>

namespace crumple::io {

// A scene file as written, before anything it names is read. Errors: no file, over 256 MiB, and parse_json's with the
// file's name and line.
Result<v1::Scene> read_scene_message(const std::filesystem::path& file);

struct LoadedScene {
  sim::SceneDescription scene;
  scene_convert::RecordingSettings recording;
};

// A scene file (protobuf JSON of crumple.v1.Scene) with all that it names and generates; it has passed sim::validate.
// Files that it names lie in its folder (scene_folder.h). Its name is the file's where it gives none.
// Errors name file, line, field, value and rule:
//   "bodies[2].fem.material.poisson_ratio is 0.5, must be below 0.5 (pane.json, line 41)".
Result<LoadedScene> load_scene(const std::filesystem::path& file);

// Names of the scene files in a folder without .json, sorted. A folder that cannot be read has none.
std::vector<std::string> scene_names(const std::filesystem::path& folder);

}  // namespace crumple::io
