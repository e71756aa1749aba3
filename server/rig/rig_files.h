#pragma once

#include "server/authoring/rig_pipeline.h"

#include <filesystem>

// The JSON files of proto/crumple/v1/rig.proto. Errors name file, line, field, value and rule.
namespace crumple::rig {

Result<authoring::GivenHandles> read_handles(const std::filesystem::path& file);
Result<std::vector<authoring::NamedPose>> read_poses(const std::filesystem::path& file);

}  // namespace crumple::rig
