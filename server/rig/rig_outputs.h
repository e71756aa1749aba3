#pragma once

#include "server/sim/example_based/example_set.h"

#include <nlohmann/json.hpp>

namespace crumple::rig {

// Asks for outputs (option and file, empty: none) that are neither one of the inputs nor each other.
Result<void> check_apart(const std::vector<std::string>& inputs,
                         const std::vector<std::pair<std::string, std::string>>& outputs);

// Where a command's results go; empty: nowhere.
struct RigOutputs {
  std::string asset;    // .crumple-asset (binary) or .json
  std::string picture;  // .png or .svg
  std::string scene;    // .json: drops the asset
  std::string gltf;     // .glb

  // Asks for these endings, for files that are neither one of `inputs` nor each other, and for a scene that can name
  // the asset.
  Result<void> check(const std::vector<std::string>& inputs) const;

  // Writes them all; what was written, and warnings, go into `result`.
  Result<void> write(const sim::example_based::ExampleSet& set, nlohmann::json& result) const;
};

}  // namespace crumple::rig
