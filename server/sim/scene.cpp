#include "server/sim/scene.h"

#include "server/sim/limits.h"
#include "server/sim/model_validation.h"

#include <unordered_map>

namespace crumple::sim {
namespace {

std::string entry(const char* list, std::size_t i) { return std::string(list) + "[" + std::to_string(i) + "]"; }

void check_world(FirstBreach& breach, const SceneDescription& scene) {
  breach.require(scene.name.size() <= limits::kMaxNameBytes, "name",
                 "has " + std::to_string(scene.name.size()) + " bytes, must have at most " +
                     std::to_string(limits::kMaxNameBytes));
  breach.vector(scene.gravity, limits::kGravity, "gravity");
  breach.number(scene.dt, limits::kTimeStep, "dt");
  breach.number(scene.rigid_substeps, limits::kSubsteps, "rigid_substeps");
  breach.number(scene.rigid_iterations, limits::kRigidIterations, "rigid_iterations");
  breach.number(scene.creep_dt, limits::kReferenceStep, "creep_dt");
  breach.number(scene.rate_dt, limits::kReferenceStep, "rate_dt");
  breach.number(scene.contact.phi, limits::kPhi, "contact.phi");
  breach.number(scene.contact.kappa, limits::kKappa, "contact.kappa");
  breach.number(scene.contact.recovery_steps, limits::kRecoverySteps, "contact.recovery_steps");
  breach.number(scene.contact.max_recovery_speed, limits::kRecoverySpeed, "contact.max_recovery_speed");
  breach.number(scene.sleep.speed, limits::kSleepSpeed, "sleep.speed");
  breach.number(scene.sleep.time, limits::kSleepTime, "sleep.time");
  breach.number(scene.sleep.wake_acceleration, limits::kWakeAcceleration, "sleep.wake_acceleration");
}

void check_name(FirstBreach& breach, const std::string& name, const std::string& field) {
  breach.require(!name.empty(), field, "is empty, must name the body");
  breach.require(
      name.size() <= limits::kMaxNameBytes, field,
      "has " + std::to_string(name.size()) + " bytes, must have at most " + std::to_string(limits::kMaxNameBytes));
}

Result<void> validate_model(const BodyDescription& body, const std::string& field, SeenAssets& seen) {
  if (const auto* rigid = std::get_if<RigidModel>(&body.model)) return validate(*rigid, field + ".rigid", seen);
  if (const auto* fem = std::get_if<FemModel>(&body.model)) return validate(*fem, field + ".fem", seen);
  return validate(std::get<ExampleModel>(body.model), field + ".example", seen);
}

void check_asleep(FirstBreach& breach, const BodyDescription& body, const std::string& field) {
  if (!body.asleep) return;
  const auto* rigid = std::get_if<RigidModel>(&body.model);
  breach.require(!rigid || rigid->kind == RigidKind::dynamic, field, "is true, must be false for a FIXED or KINEMATIC body");
  breach.require(body.velocity.isZero(0) && body.angular_velocity.isZero(0), field,
                 "is true, must be false for a body that has a velocity");
}

void check_body(FirstBreach& breach, const BodyDescription& body, const std::string& field, SeenAssets& seen) {
  static constexpr const char* kColours[] = {".r", ".g", ".b"};
  check_name(breach, body.name, field + ".name");
  breach.pose(body.pose, field + ".pose");
  breach.vector(body.velocity, limits::kVelocity, field + ".velocity");
  breach.vector(body.angular_velocity, limits::kAngularVelocity, field + ".angular_velocity");
  check_asleep(breach, body, field + ".asleep");
  for (std::size_t i = 0; i < 3; ++i) breach.number(body.colour[i], limits::kUnit, field + ".colour" + kColours[i]);
  breach.number(body.opacity, limits::kUnit, field + ".opacity");
  if (breach.ok()) breach.take(validate_model(body, field, seen));
}

void check_bodies(FirstBreach& breach, const SceneDescription& scene) {
  breach.count(scene.bodies.size(), 0, limits::kMaxBodies, "bodies");
  std::unordered_map<std::string, std::size_t> names;
  SeenAssets seen;
  std::int64_t tets = 0;
  for (std::size_t i = 0; breach.ok() && i < scene.bodies.size(); ++i) {
    const BodyDescription& body = scene.bodies[i];
    const std::string field = entry("bodies", i);
    check_body(breach, body, field, seen);
    const auto [first, is_new] = names.emplace(body.name, i);
    breach.require(is_new, field + ".name",
                   "is \"" + body.name + "\", must differ from that of " + entry("bodies", first->second));
    if (breach.ok()) tets += tet_count(body);
    breach.require(tets <= kMaxTets, field,
                   "brings the scene to " + std::to_string(tets) + " tets, must be at most " +
                       std::to_string(kMaxTets) + " in all");
  }
}

bool moves(const BodyDescription& body) {
  const auto* rigid = std::get_if<RigidModel>(&body.model);
  return !rigid || rigid->kind == RigidKind::dynamic;
}

void check_joints(FirstBreach& breach, const SceneDescription& scene) {
  breach.number(scene.max_breaks_per_step, limits::kBreaks, "max_breaks_per_step");
  breach.number(scene.joint_time, limits::kJointTime, "joint_time");
  breach.count(scene.joints.size(), 0, limits::kMaxJoints, "joints");
  for (std::size_t i = 0; breach.ok() && i < scene.joints.size(); ++i) {
    const JointDescription& joint = scene.joints[i];
    const std::string field = entry("joints", i);
    for (const auto& [id, end] : {std::pair(joint.a, ".a"), std::pair(joint.b, ".b")}) {
      breach.require(id < scene.bodies.size(), field + end,
                     "is body " + std::to_string(id) + ", must be one of the scene's " + std::to_string(scene.bodies.size()));
      if (!breach.ok()) return;
      breach.require(!std::holds_alternative<FemModel>(scene.bodies[id].model), field + end,
                     "is \"" + scene.bodies[id].name + "\", must not be a finite-element body");
    }
    breach.require(joint.a != joint.b, field + ".b", "is \"" + scene.bodies[joint.b].name + "\", must be another body than a");
    breach.require(moves(scene.bodies[joint.a]) || moves(scene.bodies[joint.b]), field,
                   "joins two bodies that are FIXED or KINEMATIC, must join one that is not");
    breach.vector(joint.point, kMaxPosition, field + ".position");
    breach.number(joint.strength, limits::kBearing, field + ".strength");
    breach.number(joint.bending, limits::kBearing, field + ".bending");
  }
}

// The command's target: it exists, forces move it, and its nodes exist.
struct TargetCheck {
  FirstBreach& breach;
  const SceneDescription& scene;
  const std::string& field;

  const BodyDescription* target(BodyId id) {
    breach.require(
        id < scene.bodies.size(), field + ".body",
        "is body " + std::to_string(id) + ", must be one of the scene's " + std::to_string(scene.bodies.size()));
    return breach.ok() ? &scene.bodies[id] : nullptr;
  }
  void operator()(const ApplyImpulse& c) { require_free(target(c.body)); }
  void operator()(const ApplyForce& c) { require_free(target(c.body)); }
  void operator()(const ApplyNodeImpulse& c) {
    const BodyDescription* body = target(c.body);
    if (!body) return;
    const auto* fem = std::get_if<FemModel>(&body->model);
    breach.require(fem != nullptr, field + ".body", "is \"" + body->name + "\", must be a finite-element body");
    for (std::size_t i = 0; breach.ok() && i < c.nodes.size(); ++i)
      if (c.nodes[i] < 0 || c.nodes[i] >= fem->mesh->node_count())
        breach.require(false, entry((field + ".nodes").c_str(), i),
                       "is " + std::to_string(c.nodes[i]) + ", must be a node of \"" + body->name + "\", below " +
                           std::to_string(fem->mesh->node_count()));
  }
  void operator()(const SetExampleParameters& c) {
    const BodyDescription* body = target(c.body);
    breach.require(!body || std::holds_alternative<ExampleModel>(body->model), field + ".body",
                   body ? "is \"" + body->name + "\", must be an example-based body" : "");
  }
  void require_free(const BodyDescription* body) {
    breach.require(!body || moves(*body), field + ".body",
                   body ? "is \"" + body->name + "\", must be a body that is neither FIXED nor KINEMATIC" : "");
  }
};

void check_script(FirstBreach& breach, const SceneDescription& scene) {
  static constexpr const char* kNames[] = {".command.apply_impulse", ".command.apply_force",
                                           ".command.apply_node_impulse", ".command.set_example_parameters"};
  breach.count(scene.script.size(), 0, limits::kMaxScript, "script");
  for (std::size_t i = 0; breach.ok() && i < scene.script.size(); ++i) {
    const ScriptedCommand& scripted = scene.script[i];
    const std::string field = entry("script", i);
    breach.number(scripted.time, limits::kTime, field + ".time");
    if (i > 0)
      breach.require(scripted.time >= scene.script[i - 1].time, field + ".time",
                     "is " + number_text(scripted.time) + ", must not be below the command before it (" +
                         number_text(scene.script[i - 1].time) + ")");
    const std::string command = field + kNames[scripted.command.index()];
    breach.take(validate(scripted.command, command));
    if (breach.ok()) std::visit(TargetCheck{breach, scene, command}, scripted.command);
  }
}

}  // namespace

Result<void> validate(const SceneDescription& scene) {
  FirstBreach breach;
  check_world(breach, scene);
  check_bodies(breach, scene);
  if (breach.ok()) check_joints(breach, scene);
  check_script(breach, scene);
  return breach.result();
}

}  // namespace crumple::sim
