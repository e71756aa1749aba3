#include "server/scene_convert/command_convert.h"

#include "server/scene_convert/example_convert.h"
#include "server/scene_convert/geometry_convert.h"
#include "server/sim/limits.h"

namespace crumple::scene_convert {
namespace {

Result<BodyId> to_body(const std::string& name, const FindBody& find, const std::string& field) {
  if (const std::optional<BodyId> id = find(name)) return *id;
  return invalid(field + ".body", "is \"" + name + "\", must name a body of the scene");
}

Result<sim::Command> checked(sim::Command command, const std::string& field) {
  if (auto valid = validate(command, field); !valid) return std::unexpected(valid.error());
  return command;
}

}  // namespace

Result<sim::Command> to_command(const v1::Command& message, const FindBody& find, const std::string& field) {
  switch (message.command_case()) {
    case v1::Command::kApplyImpulse:
      return to_command(message.apply_impulse(), find, field + ".apply_impulse");
    case v1::Command::kApplyForce:
      return to_command(message.apply_force(), find, field + ".apply_force");
    case v1::Command::kApplyNodeImpulse:
      return to_command(message.apply_node_impulse(), find, field + ".apply_node_impulse");
    case v1::Command::kSetExampleParameters:
      return to_command(message.set_example_parameters(), find, field + ".set_example_parameters");
    case v1::Command::COMMAND_NOT_SET:
      break;
  }
  return invalid(field, "is empty, must be one of apply_impulse, apply_force, apply_node_impulse, set_example_parameters");
}

Result<sim::Command> to_command(const v1::ApplyImpulse& message, const FindBody& find, const std::string& field) {
  const Result<BodyId> body = to_body(message.body(), find, field);
  if (!body) return std::unexpected(body.error());
  sim::ApplyImpulse command{*body, to_vec3(message.impulse()), to_vec3(message.point())};
  if (message.has_radius()) command.radius = message.radius();
  return checked(command, field);
}

Result<sim::Command> to_command(const v1::ApplyForce& message, const FindBody& find, const std::string& field) {
  const Result<BodyId> body = to_body(message.body(), find, field);
  if (!body) return std::unexpected(body.error());
  sim::ApplyForce command{*body, to_vec3(message.force()), to_vec3(message.point())};
  if (message.has_radius()) command.radius = message.radius();
  if (message.has_duration()) command.duration = message.duration();
  return checked(command, field);
}

Result<sim::Command> to_command(const v1::ApplyNodeImpulse& message, const FindBody& find, const std::string& field) {
  const Result<BodyId> body = to_body(message.body(), find, field);
  if (!body) return std::unexpected(body.error());
  return checked(
      sim::ApplyNodeImpulse{*body, {message.nodes().begin(), message.nodes().end()}, to_vec3(message.impulse())},
      field);
}

Result<sim::Command> to_command(const v1::SetExampleParameters& message, const FindBody& find, const std::string& field) {
  const Result<BodyId> body = to_body(message.body(), find, field);
  if (!body) return std::unexpected(body.error());
  sim::SetExampleParameters command{*body};
  if (message.has_alpha()) command.alpha = message.alpha();
  if (message.has_beta()) command.beta = message.beta();
  if (message.has_gamma()) command.gamma = message.gamma();
  if (message.has_lambda()) command.lambda = message.lambda();
  if (message.has_mu()) command.mu = message.mu();
  if (message.has_nu()) command.nu = message.nu();
  if (message.has_restitution()) command.restitution = message.restitution();
  if (message.has_secondary_goal()) {
    const auto goal = to_secondary_goal(message.secondary_goal(), field + ".secondary_goal");
    if (!goal) return std::unexpected(goal.error());
    command.secondary_goal = *goal;
  }
  if (message.has_goal_tolerance()) command.goal_tolerance = message.goal_tolerance();
  if (message.has_keep_volume()) command.keep_volume = message.keep_volume();
  if (message.has_fatigue_time()) command.fatigue_time = message.fatigue_time();
  return checked(command, field);
}

Result<sim::ScriptedCommand> to_scripted(const v1::ScriptedCommand& message, const FindBody& find,
                                         const std::string& field) {
  sim::FirstBreach breach;
  breach.number(message.time(), sim::limits::kTime, field + ".time");
  if (!breach.ok()) return std::unexpected(breach.result().error());
  Result<sim::Command> command = to_command(message.command(), find, field + ".command");
  if (!command) return std::unexpected(command.error());
  return sim::ScriptedCommand{message.time(), *std::move(command)};
}

}  // namespace crumple::scene_convert
