#pragma once

#include "client/sdk/simulation_client.h"
#include "server/runtime/scene_library.h"
#include "server/runtime/world_registry.h"

namespace crumple::client {

// A client of worlds in this very process: same calls, same errors, same bits as over gRPC; frames are encoded and
// decoded with the codec asked for. `scenes` may be null. Both must outlive the client and its streams.
std::unique_ptr<SimulationClient> in_process(runtime::WorldRegistry& registry,
                                             const runtime::SceneLibrary* scenes = nullptr);

}  // namespace crumple::client
