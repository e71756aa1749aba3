#pragma once

#include "crumple/v1/simulation.grpc.pb.h"
#include "server/runtime/scene_library.h"
#include "server/runtime/world_registry.h"

namespace crumple::grpc_server {

// All methods by callback; Watch on raw bytes (watch_message.h).
using ServiceBase = v1::SimulationService::WithCallbackMethod_CreateWorld<
    v1::SimulationService::WithCallbackMethod_ListWorlds<v1::SimulationService::WithCallbackMethod_ListScenes<
        v1::SimulationService::WithCallbackMethod_GetWorld<v1::SimulationService::WithCallbackMethod_DeleteWorld<
            v1::SimulationService::WithCallbackMethod_Play<v1::SimulationService::WithCallbackMethod_Pause<
                v1::SimulationService::WithCallbackMethod_Step<v1::SimulationService::WithCallbackMethod_Apply<
                    v1::SimulationService::WithCallbackMethod_RunScript<
                        v1::SimulationService::WithRawCallbackMethod_Watch<v1::SimulationService::Service>>>>>>>>>>>;

// simulation.proto over a registry. No handler waits: a world's thread finishes the call.
class SimulationService final : public ServiceBase {
 public:
  // Both must outlive the server; `scenes` may be null.
  SimulationService(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes)
      : registry_(registry), scenes_(scenes) {}

  grpc::ServerUnaryReactor* CreateWorld(grpc::CallbackServerContext*, const v1::CreateWorldRequest*,
                                        v1::CreateWorldResponse*) override;
  grpc::ServerUnaryReactor* ListWorlds(grpc::CallbackServerContext*, const v1::ListWorldsRequest*,
                                       v1::ListWorldsResponse*) override;
  grpc::ServerUnaryReactor* ListScenes(grpc::CallbackServerContext*, const v1::ListScenesRequest*,
                                       v1::ListScenesResponse*) override;
  grpc::ServerUnaryReactor* GetWorld(grpc::CallbackServerContext*, const v1::GetWorldRequest*,
                                     v1::GetWorldResponse*) override;
  grpc::ServerUnaryReactor* DeleteWorld(grpc::CallbackServerContext*, const v1::DeleteWorldRequest*,
                                        v1::DeleteWorldResponse*) override;
  grpc::ServerUnaryReactor* Play(grpc::CallbackServerContext*, const v1::PlayRequest*, v1::PlayResponse*) override;
  grpc::ServerUnaryReactor* Pause(grpc::CallbackServerContext*, const v1::PauseRequest*, v1::PauseResponse*) override;
  grpc::ServerUnaryReactor* Step(grpc::CallbackServerContext*, const v1::StepRequest*, v1::StepResponse*) override;
  grpc::ServerUnaryReactor* Apply(grpc::CallbackServerContext*, const v1::ApplyRequest*, v1::ApplyResponse*) override;
  grpc::ServerUnaryReactor* RunScript(grpc::CallbackServerContext*, const v1::RunScriptRequest*,
                                      v1::RunScriptResponse*) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Watch(grpc::CallbackServerContext*) override;

 private:
  runtime::WorldRegistry& registry_;
  const runtime::SceneLibrary* scenes_;
};

}  // namespace crumple::grpc_server
