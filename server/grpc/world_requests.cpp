#include "server/grpc/world_requests.h"

#include "common/text.h"
#include "server/scene_convert/command_convert.h"
#include "server/scene_convert/scene_convert.h"

#include <algorithm>
#include <cstdlib>

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

// "apply_impulse" and so on: the field of the message that is set.
std::string kind_field(const v1::Command& command) {
  const auto* field = v1::Command::descriptor()->FindFieldByNumber(command.command_case());
  return field ? field->name() : "";
}

// The core's commands have no path of their own: what World::submit finds in "body" is in `at`.body of the request.
Error at_field(const std::string& at, Error error) {
  if (error.code == ErrorCode::invalid_argument) error.field = error.field.empty() ? at : at + "." + error.field;
  return error;
}

// "script[3].nodes[0]", as World::schedule says it, is "commands[3].command.apply_node_impulse.nodes[0]".
Error at_script_field(const v1::RunScriptRequest& request, Error error) {
  static const std::string kList = "script[";
  if (!error.field.starts_with(kList)) return error;
  const int index = std::atoi(error.field.c_str() + kList.size());
  const std::string rest = error.field.substr(std::min(error.field.find(']') + 1, error.field.size()));
  if (index >= request.commands_size()) return error;
  const std::string entry = text("commands[", index, "]");
  error.field = entry + (rest == ".time" ? rest : ".command." + kind_field(request.commands(index).command()) + rest);
  return error;
}

}  // namespace

void create_world(runtime::WorldRegistry& registry, const runtime::SceneLibrary* scenes,
                  const v1::CreateWorldRequest& request, runtime::Done<WorldId> done) {
  if (request.name().size() > kMaxNameBytes)
    return done(invalid("name", text("has ", request.name().size(), " bytes, must have at most ", kMaxNameBytes)));
  registry.create(request.name(), [scenes, &request] { return make_scene(scenes, request); }, std::move(done));
}

void apply(runtime::WorldRunner& world, const v1::ApplyRequest& request, runtime::Done<std::uint64_t> done) {
  const auto make = [&request](const sim::World& w) {
    return scene_convert::to_command(request.command(), bodies_of(w), "command");
  };
  world.submit(make, [&request, done = std::move(done)](Result<std::uint64_t> result) {
    // The conversion's errors have their whole path already.
    if (!result && !result.error().field.starts_with("command"))
      result.error() = at_field("command." + kind_field(request.command()), result.error());
    done(std::move(result));
  });
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
  world.schedule(make, request.absolute(), [&request, done = std::move(done)](Result<double> result) {
    if (!result) result.error() = at_script_field(request, result.error());
    done(std::move(result));
  });
}

}  // namespace crumple::world_requests
