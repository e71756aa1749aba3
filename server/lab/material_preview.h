#pragma once

#include "common/error.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

// What a material does, before it is put into a game: panels of it pushed, bent and struck.
namespace crumple::lab {

struct PreviewFiles {
  std::filesystem::path material;        // protobuf JSON of crumple.v1.FemMaterial
  std::filesystem::path splinters = {};  // of crumple.v1.Splinters; empty: none
};

// The scene (protobuf JSON of crumple.v1.Scene). Panels of 1.2 x 1.2 x 0.1 m, 12 x 12 x 1 cells: one held at two edges into
// which a ball is pressed 0.3 m deep and taken away again; one whose free edge is bent round by 70 degrees and back; one
// held at two edges that a ball of 100 kg hits at 20 m/s. Errors: those of reading the files, with the line in them.
Result<std::string> preview_scene(const PreviewFiles& files);

// Runs it for 3 s, and writes into `folder` preview.json, the scene, and preview.svg: each panel when it is loaded most and
// at the end, stress in red. Returns {"scene", "picture": paths, panel: {"pieces", "rigid_pieces", "stress_largest" [Pa],
// "plastic_strain_largest"}}, panel being "pushed", "bent" or "struck".
Result<nlohmann::json> preview_material(const PreviewFiles& files, const std::filesystem::path& folder);

}  // namespace crumple::lab
