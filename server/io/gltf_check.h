#pragma once

#include "common/error.h"

#include <string>
#include <string_view>

namespace crumple::io {

// The JSON of a glTF document: all of a .gltf, the first chunk of a .glb. Errors: a .glb without it, or cut off.
Result<std::string_view> gltf_json(std::string_view content, const std::string& name);

// The binary chunk of a .glb, which follows; empty where there is none.
std::string_view gltf_binary(std::string_view content);

// What must hold before a glTF 2 document (.gltf, or the first chunk of a .glb) is read, by Assimp, which recurses
// without a limit, or by ourselves: JSON of at most 64 levels; nodes that form a forest (as the format demands) of at
// most 1000 levels; accessors of at most 50 million items; a version that begins with 2; buffers and images that are in
// the file itself or in files of its folder or below. Errors name the file, and the field where there is one.
Result<void> check_gltf(std::string_view content, const std::string& name);

}  // namespace crumple::io
