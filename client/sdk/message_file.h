#pragma once

#include "common/error.h"
#include "crumple/v1/scene.pb.h"

#include <string>
#include <vector>

// Messages from files of protobuf JSON. Values are checked by the server. Errors: not_found; invalid_argument if it is
// not such JSON, with the parser's words. The field is the file's path.
namespace crumple::client {

// A scene file, to create a world from.
Result<v1::Scene> read_scene_message(const std::string& path);

// {"commands": [{"time": 0.5, "command": {"apply_impulse": {...}}}, ...]}, to run as a script.
Result<std::vector<v1::ScriptedCommand>> read_script_message(const std::string& path);

}  // namespace crumple::client
