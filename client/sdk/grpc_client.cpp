#include "client/sdk/grpc_watch_stream.h"
#include "client/sdk/message_convert.h"
#include "client/sdk/simulation_client.h"
#include "common/text.h"

#include <grpcpp/create_channel.h>

#include <limits>

namespace crumple::client {
namespace {

class GrpcClient final : public SimulationClient {
 public:
  using Stub = v1::SimulationService::Stub;

  GrpcClient(const std::shared_ptr<grpc::Channel>& channel, const ConnectOptions& options)
      : stub_(v1::SimulationService::NewStub(channel)), options_(options) {}

  Result<WorldId> create_world(const v1::Scene& scene, const std::string& name) override {
    v1::CreateWorldRequest request;
    *request.mutable_scene() = scene;
    return create(request, name);
  }

  Result<WorldId> create_world_from_file(const std::string& scene_file, const std::string& name) override {
    v1::CreateWorldRequest request;
    request.set_scene_file(scene_file);
    return create(request, name);
  }

  Result<std::vector<WorldStatus>> list_worlds() override {
    const auto response = call<v1::ListWorldsResponse>(&Stub::ListWorlds, v1::ListWorldsRequest());
    if (!response) return std::unexpected(response.error());
    std::vector<WorldStatus> worlds;
    for (const v1::WorldStatus& world : response->worlds()) worlds.push_back(from_message(world));
    return worlds;
  }

  Result<std::vector<std::string>> list_scenes() override {
    const auto response = call<v1::ListScenesResponse>(&Stub::ListScenes, v1::ListScenesRequest());
    if (!response) return std::unexpected(response.error());
    return std::vector<std::string>(response->scenes().begin(), response->scenes().end());
  }

  Result<WorldInfo> world(WorldId world, bool bodies, bool state_hash) override {
    v1::GetWorldRequest request;
    request.set_world(world);
    request.set_bodies(bodies);
    request.set_state_hash(state_hash);
    const auto response = call<v1::GetWorldResponse>(&Stub::GetWorld, request);
    if (!response) return std::unexpected(response.error());
    WorldInfo info{from_message(response->status()), {}, response->state_hash()};
    for (const v1::BodyStatus& body : response->bodies()) info.bodies.push_back(from_message(body));
    return info;
  }

  Result<void> delete_world(WorldId world) override {
    v1::DeleteWorldRequest request;
    request.set_world(world);
    return outcome(call<v1::DeleteWorldResponse>(&Stub::DeleteWorld, request));
  }

  Result<void> play(WorldId world, double speed) override {
    v1::PlayRequest request;
    request.set_world(world);
    request.set_speed(speed);
    return outcome(call<v1::PlayResponse>(&Stub::Play, request));
  }

  Result<std::uint64_t> pause(WorldId world) override {
    v1::PauseRequest request;
    request.set_world(world);
    const auto response = call<v1::PauseResponse>(&Stub::Pause, request);
    if (!response) return std::unexpected(response.error());
    return response->step();
  }

  Result<StepSummary> step(WorldId world, std::uint32_t steps, bool state_hash) override {
    v1::StepRequest request;
    request.set_world(world);
    request.set_steps(steps);
    request.set_state_hash(state_hash);
    const auto response = call<v1::StepResponse>(&Stub::Step, request, /*any_time=*/true);
    if (!response) return std::unexpected(response.error());
    return from_message(*response);
  }

  Result<std::uint64_t> apply(WorldId world, const v1::Command& command) override {
    v1::ApplyRequest request;
    request.set_world(world);
    *request.mutable_command() = command;
    const auto response = call<v1::ApplyResponse>(&Stub::Apply, request);
    if (!response) return std::unexpected(response.error());
    return response->step();
  }

  Result<double> run_script(WorldId world, const std::vector<v1::ScriptedCommand>& commands, bool absolute) override {
    v1::RunScriptRequest request;
    request.set_world(world);
    request.mutable_commands()->Assign(commands.begin(), commands.end());
    request.set_absolute(absolute);
    const auto response = call<v1::RunScriptResponse>(&Stub::RunScript, request);
    if (!response) return std::unexpected(response.error());
    return response->time();
  }

  Result<std::unique_ptr<WatchStream>> watch(WorldId world, const WatchOptions& options) override {
    return GrpcWatchStream::open(*stub_, world, options);
  }

 private:
  template <class Response, class Request>
  Result<Response> call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        const Request& request, bool any_time = false) {
    grpc::ClientContext context;
    if (!any_time) context.set_deadline(std::chrono::system_clock::now() + options_.call_timeout);
    Response response;
    const grpc::Status status = (stub_.get()->*method)(&context, request, &response);
    if (!status.ok()) return std::unexpected(to_error(status));
    return response;
  }

  template <class Response>
  static Result<void> outcome(const Result<Response>& response) {
    if (!response) return std::unexpected(response.error());
    return {};
  }

  Result<WorldId> create(v1::CreateWorldRequest& request, const std::string& name) {
    request.set_name(name);
    const auto response = call<v1::CreateWorldResponse>(&Stub::CreateWorld, request);
    if (!response) return std::unexpected(response.error());
    return response->world();
  }

  const std::unique_ptr<Stub> stub_;
  const ConnectOptions options_;
};

}  // namespace

Result<std::unique_ptr<SimulationClient>> connect(const std::string& address, const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(std::numeric_limits<int>::max());  // payloads know their own limit
  arguments.SetMaxSendMessageSize(std::numeric_limits<int>::max());
  const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  if (!channel->WaitForConnected(std::chrono::system_clock::now() + options.connect_timeout))
    return std::unexpected(Error{ErrorCode::unavailable, "", text("no server answers at ", address)});
  return std::make_unique<GrpcClient>(channel, options);
}

}  // namespace crumple::client
