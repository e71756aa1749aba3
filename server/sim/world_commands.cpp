#include "common/text.h"
#include "server/sim/world_impl.h"

#include <algorithm>

// What clients and scripts may do to a running world.
namespace crumple::sim {

Result<void> World::Impl::check(const Command& command, const std::string& field) const {
  if (auto valid = validate(command, field); !valid) return valid;
  const std::string at = field.empty() ? "" : field + ".";
  const BodyId body = std::visit([](const auto& c) { return c.body; }, command);
  if (body >= places.size()) {
    return std::unexpected(Error{ErrorCode::not_found, at + "body", text("is ", body, ", the world has ", places.size(), " bodies")});
  }
  const Place place = places[body];
  if (const auto* push = std::get_if<ApplyNodeImpulse>(&command)) {
    if (place.model != BodyModel::fem) {
      return invalid(at + "body", text("is ", body, ", which has no nodes: it is not a finite-element body"));
    }
    const int count = objects[place.index].scene_node_count();
    for (std::size_t k = 0; k < push->nodes.size(); ++k) {
      if (push->nodes[k] >= 0 && push->nodes[k] < count) continue;
      return invalid(text(at, "nodes[", k, "]"), text("is ", push->nodes[k], ", must be in [0, ", count, ")"));
    }
  }
  if (std::holds_alternative<SetExampleParameters>(command)) {
    if (place.model != BodyModel::example_based) return invalid(at + "body", text("is ", body, ", which is not an example-based body"));
    return {};
  }
  const bool moves = place.model == BodyModel::fem || place.model == BodyModel::example_based ||
                     solids[place.index].model.kind == RigidKind::dynamic;
  if (!moves) return invalid(at + "body", text("is ", body, ", which no force moves: it is fixed or kinematic"));
  return {};
}

Result<void> World::submit(const Command& command) {
  if (auto valid = impl_->check(command, ""); !valid) return valid;
  impl_->commands.push_back(command);
  return {};
}

Result<void> World::schedule(const std::vector<ScriptedCommand>& script) {
  for (std::size_t k = 0; k < script.size(); ++k) {
    const std::string field = text("script[", k, "]");
    if (!(script[k].time >= 0 && script[k].time <= 1e9)) {
      return invalid(field + ".time", text("is ", script[k].time, ", must be in [0, 1e9]"));
    }
    if (auto valid = impl_->check(script[k].command, field); !valid) return valid;
  }
  impl_->script.insert(impl_->script.end(), script.begin(), script.end());
  std::stable_sort(impl_->script.begin(), impl_->script.end(),
                   [](const ScriptedCommand& a, const ScriptedCommand& b) { return a.time < b.time; });
  return {};
}

void World::Impl::apply_commands() {
  work = {};
  // A time that was meant to be a step's start may miss it by rounding.
  const double now = time() + 1e-9 * scene.dt;
  disturbed.assign(part_count(), 0);
  auto due = script.begin();
  for (; due != script.end() && due->time <= now; ++due) {
    apply(due->command);
    const BodyId body = std::visit([](const auto& c) { return c.body; }, due->command);
    add_event(EventKind::script, body).message = text(std::holds_alternative<SetExampleParameters>(due->command) ? "script: parameters of " : "script: push on ", scene.bodies[body].name);
  }
  script.erase(script.begin(), due);
  for (const Command& command : commands) apply(command);
  commands.clear();

  for (ActiveForce& active : forces) {
    const double acting = std::min(scene.dt, active.left);
    push_body(active.force.body, active.force.force * acting, active.force.point, active.force.radius);
    active.left -= scene.dt;
  }
  std::erase_if(forces, [&](const ActiveForce& active) { return active.left <= 1e-9 * scene.dt; });
  feel_commands();
}

void World::Impl::apply(const Command& command) {
  if (const auto* push = std::get_if<ApplyImpulse>(&command)) {
    push_body(push->body, push->impulse, push->point, push->radius);
  } else if (const auto* force = std::get_if<ApplyForce>(&command)) {
    forces.push_back({*force, force->duration > 0 ? force->duration : scene.dt});
  } else if (const auto* parameters = std::get_if<SetExampleParameters>(&command)) {
    examples[places[parameters->body].index].set_parameters(*parameters);
  } else {
    const auto& nodes = std::get<ApplyNodeImpulse>(command);
    objects[places[nodes.body].index].push_nodes(soft, nodes.impulse, nodes.nodes);
  }
}

void World::Impl::push_body(BodyId body, const Vec3& impulse, const Vec3& point, double radius) {
  const Place place = places[body];
  if (place.model == BodyModel::fem) {
    objects[place.index].push(soft, impulse, point, radius);
    return;
  }
  const bool felt = is_felt(impulse.norm() / rigid.mass(body));
  if (felt) wake(body);
  disturbed[body] |= felt;
  if (is_asleep(body_part(body))) return;
  const double before = rigid.kinetic_energy(body);
  rigid.apply_impulse(body, impulse, point);
  work.rigid_commands += rigid.kinetic_energy(body) - before;
  if (place.model == BodyModel::example_based) {
    const Pose X_WB = rigid.pose(body);
    const Quat R_BW = X_WB.R_WB.conjugate();
    examples[place.index].strike(R_BW * (point - X_WB.p_WB), R_BW * impulse);
  }
}

}  // namespace crumple::sim
