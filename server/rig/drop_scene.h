#pragma once

#include "server/sim/example_based/example_set.h"

#include <filesystem>

namespace crumple::rig {

// A scene file (JSON of crumple.v1.Scene) that drops an asset, tilted, from its own size above the ground, beside a
// block that it falls on; its parameters are in proportion to its size and mass, so that it dents by its examples.
// Mass: 150 kg/m^3 of the tets. Errors: scene_can_name's.
Result<std::string> drop_scene(const sim::example_based::ExampleSet& set, const std::filesystem::path& asset,
                               const std::filesystem::path& scene);

// An error unless the asset lies in the scene's folder or below it, where scenes look for their files.
Result<void> scene_can_name(const std::filesystem::path& asset, const std::filesystem::path& scene);

}  // namespace crumple::rig
