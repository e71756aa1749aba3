#pragma once

#include "crumple/v1/simulation.pb.h"
#include "server/runtime/scene_library.h"
#include "server/runtime/world_registry.h"

// Calls whose requests carry scenes and commands, from message to world. Shared by all transports, and knows none.
// A request must live until `done` is called. Errors: as simulation.proto documents them, the field as written there.
namespace crumple::world_requests {

// `scenes` may be null: then no scene has a name.
void create_world(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes,
                  const v1::CreateWorldRequest& request, runtime::Done<WorldId> done);

// Answers the step in which the command acts.
void apply(runtime::WorldRunner& world, const v1::ApplyRequest& request, runtime::Done<std::uint64_t> done);

// Answers the time when the script was taken [s].
void run_script(runtime::WorldRunner& world, const v1::RunScriptRequest& request, runtime::Done<double> done);

}  // namespace crumple::world_requests
