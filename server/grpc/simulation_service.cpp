#include "server/grpc/simulation_service.h"

#include "server/grpc/convert.h"
#include "server/grpc/watch_reactor.h"
#include "server/grpc/world_requests.h"

namespace crumple::grpc_server {
namespace {

// The done callback of a call: fills the response by fill(value) and finishes. gRPC keeps the call's messages and its
// reactor until then, also if the client has left.
template <class T, class Fill>
runtime::Done<T> finish(grpc::ServerUnaryReactor* reactor, Fill fill) {
  return [=](Result<T> result) {
    if (result) fill(*result);
    reactor->Finish(to_status(result));
  };
}

// Calls use(world), or finishes the call if there is no such world.
template <class Use>
grpc::ServerUnaryReactor* with_world(const runtime::WorldRegistry& registry, WorldId id,
                                     grpc::CallbackServerContext* context, Use use) {
  auto* reactor = context->DefaultReactor();
  const auto world = registry.find(id);
  if (world) {
    use(**world, reactor);
  } else {
    reactor->Finish(to_status(world.error()));
  }
  return reactor;
}

}  // namespace

using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

ServerUnaryReactor* SimulationService::CreateWorld(CallbackServerContext* context,
                                                   const v1::CreateWorldRequest* request,
                                                   v1::CreateWorldResponse* response) {
  auto* reactor = context->DefaultReactor();
  world_requests::create_world(registry_, scenes_, *request,
                               finish<WorldId>(reactor, [=](WorldId id) { response->set_world(id); }));
  return reactor;
}

ServerUnaryReactor* SimulationService::ListWorlds(CallbackServerContext* context, const v1::ListWorldsRequest*,
                                                  v1::ListWorldsResponse* response) {
  for (const WorldStatus& status : registry_.list()) *response->add_worlds() = to_message(status);
  auto* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

ServerUnaryReactor* SimulationService::ListScenes(CallbackServerContext* context, const v1::ListScenesRequest*,
                                                  v1::ListScenesResponse* response) {
  if (scenes_)
    for (const std::string& name : scenes_->names()) response->add_scenes(name);
  auto* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

ServerUnaryReactor* SimulationService::GetWorld(CallbackServerContext* context, const v1::GetWorldRequest* request,
                                                v1::GetWorldResponse* response) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    const auto fill = [=](const WorldInfo& info) {
      *response->mutable_status() = to_message(info.status);
      for (const BodyStatus& body : info.bodies) *response->add_bodies() = to_message(body);
      response->set_state_hash(info.state_hash);
    };
    world.info(request->bodies(), request->state_hash(), finish<WorldInfo>(reactor, fill));
  });
}

ServerUnaryReactor* SimulationService::DeleteWorld(CallbackServerContext* context,
                                                   const v1::DeleteWorldRequest* request, v1::DeleteWorldResponse*) {
  auto* reactor = context->DefaultReactor();
  reactor->Finish(to_status(registry_.remove(request->world())));
  return reactor;
}

ServerUnaryReactor* SimulationService::Play(CallbackServerContext* context, const v1::PlayRequest* request,
                                            v1::PlayResponse*) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    world.play(request->has_speed() ? request->speed() : 1,
               [reactor](Result<void> result) { reactor->Finish(to_status(result)); });
  });
}

ServerUnaryReactor* SimulationService::Pause(CallbackServerContext* context, const v1::PauseRequest* request,
                                             v1::PauseResponse* response) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    world.pause(finish<std::uint64_t>(reactor, [=](std::uint64_t step) { response->set_step(step); }));
  });
}

ServerUnaryReactor* SimulationService::Step(CallbackServerContext* context, const v1::StepRequest* request,
                                            v1::StepResponse* response) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    world.step(request->steps(), request->state_hash(),
               finish<StepSummary>(reactor, [=](const StepSummary& summary) { *response = to_message(summary); }));
  });
}

ServerUnaryReactor* SimulationService::Apply(CallbackServerContext* context, const v1::ApplyRequest* request,
                                             v1::ApplyResponse* response) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    world_requests::apply(world, *request,
                          finish<std::uint64_t>(reactor, [=](std::uint64_t step) { response->set_step(step); }));
  });
}

ServerUnaryReactor* SimulationService::RunScript(CallbackServerContext* context, const v1::RunScriptRequest* request,
                                                 v1::RunScriptResponse* response) {
  return with_world(registry_, request->world(), context, [=](runtime::WorldRunner& world, ServerUnaryReactor* reactor) {
    world_requests::run_script(world, *request, finish<double>(reactor, [=](double time) { response->set_time(time); }));
  });
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* SimulationService::Watch(CallbackServerContext* context) {
  return WatchReactor::start(registry_, *context);
}

}  // namespace crumple::grpc_server
