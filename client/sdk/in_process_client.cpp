#include "client/sdk/in_process_client.h"

#include "client/sdk/in_process_watch_stream.h"
#include "common/text.h"
#include "server/grpc/world_requests.h"

#include <future>

namespace crumple::client {
namespace {

// Starts a call with a done callback and waits for its answer.
template <class T, class Start>
Result<T> wait_for(Start start) {
  const auto promise = std::make_shared<std::promise<Result<T>>>();  // shared: set_value may outlast get
  start([promise](Result<T> result) { promise->set_value(std::move(result)); });
  return promise->get_future().get();
}

class InProcessClient final : public SimulationClient {
 public:
  InProcessClient(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes)
      : registry_(registry), scenes_(scenes) {}

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

  Result<std::vector<WorldStatus>> list_worlds() override { return registry_.list(); }

  Result<std::vector<std::string>> list_scenes() override {
    return scenes_ ? scenes_->names() : std::vector<std::string>();
  }

  Result<WorldInfo> world(WorldId id, bool bodies, bool state_hash) override {
    return with_world<WorldInfo>(id, [=](auto& world, auto done) { world.info(bodies, state_hash, done); });
  }

  Result<void> delete_world(WorldId id) override { return registry_.remove(id); }

  Result<void> play(WorldId id, double speed) override {
    return with_world<void>(id, [=](auto& world, auto done) { world.play(speed, done); });
  }

  Result<std::uint64_t> pause(WorldId id) override {
    return with_world<std::uint64_t>(id, [](auto& world, auto done) { world.pause(done); });
  }

  Result<StepSummary> step(WorldId id, std::uint32_t steps, bool state_hash) override {
    return with_world<StepSummary>(id, [=](auto& world, auto done) { world.step(steps, state_hash, done); });
  }

  Result<std::uint64_t> apply(WorldId id, const v1::Command& command) override {
    v1::ApplyRequest request;
    *request.mutable_command() = command;
    return with_world<std::uint64_t>(id, [&](auto& world, auto done) { world_requests::apply(world, request, done); });
  }

  Result<double> run_script(WorldId id, const std::vector<v1::ScriptedCommand>& commands, bool absolute) override {
    v1::RunScriptRequest request;
    request.mutable_commands()->Assign(commands.begin(), commands.end());
    request.set_absolute(absolute);
    return with_world<double>(id, [&](auto& world, auto done) { world_requests::run_script(world, request, done); });
  }

  Result<std::unique_ptr<WatchStream>> watch(WorldId id, const WatchOptions& options) override {
    if (!(options.max_rate_hz >= 0 && options.max_rate_hz <= 1000))
      return invalid("subscribe.max_rate_hz", text("is ", options.max_rate_hz, ", must lie in [0, 1000]"));
    const auto world = registry_.find(id);
    if (!world) {
      Error error = world.error();
      error.field = "subscribe." + error.field;
      return std::unexpected(std::move(error));
    }
    return std::make_unique<InProcessWatchStream>((*world)->hub(), options);
  }

 private:
  template <class T, class Use>
  Result<T> with_world(WorldId id, Use use) {
    const auto world = registry_.find(id);
    if (!world) return std::unexpected(world.error());
    return wait_for<T>([&](runtime::Done<T> done) { use(**world, std::move(done)); });
  }

  Result<WorldId> create(v1::CreateWorldRequest& request, const std::string& name) {
    request.set_name(name);
    return wait_for<WorldId>([&](runtime::Done<WorldId> done) {
      world_requests::create_world(registry_, scenes_, request, std::move(done));
    });
  }

  runtime::WorldRegistry& registry_;
  const runtime::SceneLibrary* scenes_;
};

}  // namespace

std::unique_ptr<SimulationClient> in_process(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes) {
  return std::make_unique<InProcessClient>(registry, scenes);
}

}  // namespace crumple::client
