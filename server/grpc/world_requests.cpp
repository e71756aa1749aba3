#include "server/grpc/world_requests.h"

#include "common/text.h"
#include "server/scene_convert/command_convert.h"
#include "server/scene_convert/scene_convert.h"

namespace crumple::world_requests {
namespace {

constexpr std::size_t kMaxNameBytes = 256;

scene_convert::FindBody bodies_of(const sim::World& world) {
  return [&world](const std::string& name) -> std::optional<BodyId> {
    const BodyId id = world.find(name);
    if (id == static_cast<BodyId>(world.body_count())) return std::nullopt;
    return id;
  };
}

Result<sim::SceneDescription> make_scene(const runtime::SceneLibrary* scenes, const v1::CreateWorldRequest& request) {
  if (request.has_scene()) {
    auto scene = scene_convert::to_scene(request.scene(), scene_convert::NoFiles());
    if (!scene) scene.error().field = scene.error().field.empty() ? "scene" : "scene." + scene.error().field;
    return scene;
  }
  if (!request.has_scene_file()) return invalid("source", "is missing, must be scene or scene_file");
  if (scenes) return scenes->load(request.scene_file());
  return std::unexpected(Error{ErrorCode::not_found, "scene_file", "is named, but this server has no scene folder"});
}

// World::submit and World::schedule name their argument; a call names the field of its request.
template <class T>
runtime::Done<T> with_field(const std::string& argument, const std::string& field, runtime::Done<T> done) {
  return [=](Result<T> result) {
    if (!result && result.error().code == ErrorCode::invalid_argument) {
      std::string& path = result.error().field;
      if (path.starts_with(argument)) path.erase(0, argument.size());
      if (!path.starts_with(field)) path = field + (path.empty() || path.front() == '[' || path.front() == '.' ? "" : ".") + path;
    }
    done(std::move(result));
  };
}

}  // namespace

void create_world(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes,
                  const v1::CreateWorldRequest& request, runtime::Done<WorldId> done) {
  if (request.name().size() > kMaxNameBytes)
    return done(invalid("name", text("has ", request.name().size(), " bytes, must have at most ", kMaxNameBytes)));
  registry.create(request.name(), [scenes, &request] { return make_scene(scenes, request); }, std::move(done));
}

void apply(runtime::WorldRunner& world, const v1::ApplyRequest& request, runtime::Done<std::uint64_t> done) {
  world.submit([&request](const sim::World& w) { return scene_convert::to_command(request.command(), bodies_of(w), "command"); },
               with_field("command", "command", std::move(done)));
}

void run_script(runtime::WorldRunner& world, const v1::RunScriptRequest& request, runtime::Done<double> done) {
  const auto count = static_cast<std::size_t>(request.commands_size());
  if (count > runtime::WorldRunner::kMaxScript)
    return done(invalid("commands", text("has ", count, " entries, must have at most ", runtime::WorldRunner::kMaxScript)));
  const auto make = [&request](const sim::World& w) -> Result<std::vector<sim::ScriptedCommand>> {
    std::vector<sim::ScriptedCommand> script;
    for (int i = 0; i < request.commands_size(); ++i) {
      auto command = scene_convert::to_scripted(request.commands(i), bodies_of(w), text("commands[", i, "]"));
      if (!command) return std::unexpected(command.error());
      script.push_back(*std::move(command));
    }
    return script;
  };
  world.schedule(make, request.absolute(), with_field("script", "commands", std::move(done)));
}

}  // namespace crumple::world_requests
