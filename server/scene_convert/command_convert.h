#pragma once

#include "common/error.h"
#include "crumple/v1/scene.pb.h"
#include "server/sim/command.h"

#include <functional>
#include <optional>
#include <string>

namespace crumple::scene_convert {

// The id of the body of that name, if there is one.
using FindBody = std::function<std::optional<BodyId>(const std::string& name)>;

// Commands of scripts and of calls. `field` is the path of the message and prefixes the error's. Errors: no command
// set, an unknown body, numbers that are not finite or beyond their limits, an empty node list. Whether forces move
// the body and whether its nodes exist is for the scene's gate or World::submit.
Result<sim::Command> to_command(const v1::Command& message, const FindBody& find, const std::string& field);
Result<sim::Command> to_command(const v1::ApplyImpulse& message, const FindBody& find, const std::string& field);
Result<sim::Command> to_command(const v1::ApplyForce& message, const FindBody& find, const std::string& field);
Result<sim::Command> to_command(const v1::ApplyNodeImpulse& message, const FindBody& find, const std::string& field);
Result<sim::Command> to_command(const v1::SetExampleParameters& message, const FindBody& find, const std::string& field);

// The same with a time [s] in [0, 1e9].
Result<sim::ScriptedCommand> to_scripted(const v1::ScriptedCommand& message, const FindBody& find,
                                         const std::string& field);

}  // namespace crumple::scene_convert
