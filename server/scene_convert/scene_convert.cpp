#include "server/scene_convert/scene_convert.h"

#include "server/scene_convert/asset_convert.h"
#include "server/scene_convert/command_convert.h"
#include "server/scene_convert/conversion.h"
#include "server/scene_convert/example_convert.h"
#include "server/scene_convert/fem_convert.h"
#include "server/scene_convert/geometry_convert.h"
#include "server/scene_convert/recording_convert.h"
#include "server/scene_convert/rigid_convert.h"
#include "server/sim/model_validation.h"

#include <unordered_map>

namespace crumple::scene_convert {
namespace {

constexpr std::size_t kMaxDescriptionBytes = 64 * 1024;

sim::FrictionLaw to_friction_law(int law, Conversion& c) {
  switch (law) {
    case v1::ContactSettings::COULOMB:
      return sim::FrictionLaw::coulomb;
    case v1::ContactSettings::WEIGHT_HEURISTIC:
      return sim::FrictionLaw::weight_heuristic;
    default:
      c.breach.require(false, "contact.friction", "is " + std::to_string(law) + ", must be COULOMB or WEIGHT_HEURISTIC");
  }
  return {};
}

sim::ContactSettings to_contact(const v1::ContactSettings& message, Conversion& c) {
  sim::ContactSettings contact;
  if (message.has_raw_damping()) contact.raw_damping = message.raw_damping();
  if (message.has_phi()) contact.phi = message.phi();
  if (message.has_kappa()) contact.kappa = message.kappa();
  if (message.has_recovery_steps()) contact.recovery_steps = message.recovery_steps();
  if (message.has_max_recovery_speed()) contact.max_recovery_speed = message.max_recovery_speed();
  contact.friction = to_friction_law(message.friction(), c);
  return contact;
}

sim::SleepSettings to_sleep(const v1::SleepSettings& message) {
  sim::SleepSettings sleep;
  if (message.has_speed()) sleep.speed = message.speed();
  if (message.has_time()) sleep.time = message.time();
  if (message.has_wake_acceleration()) sleep.wake_acceleration = message.wake_acceleration();
  return sleep;
}

sim::linear_solver::SolverKind to_solver(int solver, Conversion& c) {
  using sim::linear_solver::SolverKind;
  switch (solver) {
    case v1::Scene::AUTOMATIC: return SolverKind::automatic;
    case v1::Scene::BLOCK_JACOBI: return SolverKind::jacobi;
    case v1::Scene::MULTIGRID: return SolverKind::multigrid;
    case v1::Scene::DIRECT: return SolverKind::direct;
    case v1::Scene::RIGID_MODES: return SolverKind::rigid_modes;
    case v1::Scene::WARPED_FACTOR: return SolverKind::warped_factor;
    default:
      c.breach.require(false, "solver", "is " + std::to_string(solver) + ", must be AUTOMATIC, BLOCK_JACOBI, MULTIGRID, DIRECT, RIGID_MODES or WARPED_FACTOR");
  }
  return {};
}

sim::Integrator to_integrator(int integrator, Conversion& c) {
  switch (integrator) {
    case v1::Scene::BACKWARD_EULER:
      return sim::Integrator::backward_euler;
    case v1::Scene::BDF2:
      return sim::Integrator::bdf2;
    default:
      c.breach.require(false, "integrator", "is " + std::to_string(integrator) + ", must be BACKWARD_EULER or BDF2");
  }
  return {};
}

void set_world(const v1::Scene& message, sim::SceneDescription& scene, Conversion& c) {
  scene.name = message.name();
  scene.gravity = to_vec3(message.has_gravity(), message.gravity(), scene.gravity);
  if (message.has_dt()) scene.dt = message.dt();
  if (message.has_rigid_substeps()) scene.rigid_substeps = message.rigid_substeps();
  if (message.has_rigid_iterations()) scene.rigid_iterations = message.rigid_iterations();
  if (message.has_creep_dt()) scene.creep_dt = message.creep_dt();
  if (message.has_rate_dt()) scene.rate_dt = message.rate_dt();
  if (message.has_integrator()) scene.integrator = to_integrator(message.integrator(), c);
  if (message.has_float_solver()) scene.float_solver = message.float_solver();
  if (message.has_unguarded()) scene.unguarded = message.unguarded();
  scene.solver = to_solver(message.solver(), c);
  if (message.has_seed()) scene.seed = message.seed();
  scene.contact = to_contact(message.contact(), c);
  scene.sleep = to_sleep(message.sleep());
}

std::variant<sim::RigidModel, sim::FemModel, sim::ExampleModel> to_model(const v1::Body& message,
                                                                         const std::string& field, Conversion& c) {
  switch (message.model_case()) {
    case v1::Body::kRigid:
      return to_rigid(message.rigid(), field + ".rigid", c);
    case v1::Body::kFem:
      return to_fem(message.fem(), field + ".fem", c);
    case v1::Body::kExample:
      return to_example_model(message.example(), field + ".example", c);
    case v1::Body::MODEL_NOT_SET:
      break;
  }
  c.breach.require(false, field, "has no model, must be one of rigid, fem, example");
  return {};
}

sim::BodyDescription to_body(const v1::Body& message, const std::string& field, Conversion& c) {
  sim::BodyDescription body;
  body.name = message.name();
  body.pose = c.value(to_pose(message.pose(), field + ".pose"), "");
  body.velocity = to_vec3(message.velocity());
  body.angular_velocity = to_vec3(message.angular_velocity());
  if (message.has_colour()) body.colour = {message.colour().r(), message.colour().g(), message.colour().b()};
  if (message.has_opacity()) body.opacity = message.opacity();
  if (message.has_asleep()) body.asleep = message.asleep();
  body.model = to_model(message, field, c);
  return body;
}

// Stops as soon as the scene has grown beyond kMaxTets, before more is made.
void add_bodies(const v1::Scene& message, sim::SceneDescription& scene, Conversion& c) {
  c.breach.count(static_cast<std::size_t>(message.bodies_size()), 0, sim::limits::kMaxBodies, "bodies");
  std::int64_t tets = 0;
  for (int i = 0; c.breach.ok() && i < message.bodies_size() && tets <= sim::kMaxTets; ++i) {
    scene.bodies.push_back(to_body(message.bodies(i), entry("bodies", i), c));
    if (c.breach.ok()) tets += sim::tet_count(scene.bodies.back());
  }
}

FindBody finder(const sim::SceneDescription& scene) {
  std::unordered_map<std::string, BodyId> ids;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) ids.emplace(scene.bodies[i].name, static_cast<BodyId>(i));
  return [ids = std::move(ids)](const std::string& name) -> std::optional<BodyId> {
    const auto it = ids.find(name);
    return it == ids.end() ? std::nullopt : std::optional(it->second);
  };
}

void add_joints(const v1::Scene& message, sim::SceneDescription& scene, Conversion& c) {
  c.breach.count(static_cast<std::size_t>(message.joints_size()), 0, sim::limits::kMaxJoints, "joints");
  if (message.has_max_breaks_per_step()) scene.max_breaks_per_step = message.max_breaks_per_step();
  if (message.has_joint_time()) scene.joint_time = message.joint_time();
  const FindBody find = finder(scene);
  for (int i = 0; c.breach.ok() && i < message.joints_size(); ++i) {
    const v1::Joint& m = message.joints(i);
    const std::optional<BodyId> a = find(m.a()), b = find(m.b());
    for (const auto& [found, name, end] : {std::tuple(a, m.a(), ".a"), std::tuple(b, m.b(), ".b")})
      c.breach.require(found.has_value(), entry("joints", i) + end, "is \"" + name + "\", must name a body of the scene");
    if (c.breach.ok()) scene.joints.push_back({*a, *b, to_vec3(m.position()), m.strength(), m.bending()});
  }
}

void add_script(const v1::Scene& message, sim::SceneDescription& scene, Conversion& c) {
  c.breach.count(static_cast<std::size_t>(message.script_size()), 0, sim::limits::kMaxScript, "script");
  const FindBody find = finder(scene);
  for (int i = 0; c.breach.ok() && i < message.script_size(); ++i)
    scene.script.push_back(c.value(to_scripted(message.script(i), find, entry("script", i)), ""));
}

}  // namespace

Result<sim::SceneDescription> to_scene(const v1::Scene& message, const MeshSource& files) {
  Conversion c{.files = files, .breach = {}, .surfaces = {}, .tet_meshes = {}, .example_sets = {}};
  sim::SceneDescription scene;
  c.breach.require(message.description().size() <= kMaxDescriptionBytes, "description",
                   "has " + std::to_string(message.description().size()) + " bytes, must have at most 65536");
  set_world(message, scene, c);
  add_bodies(message, scene, c);
  add_joints(message, scene, c);
  if (c.breach.ok()) c.breach.take(sim::validate(scene));  // before the script, whose bodies these are
  add_script(message, scene, c);
  c.value(to_recording(message.recording()), "");
  if (c.breach.ok() && !scene.script.empty()) c.breach.take(sim::validate(scene));
  if (!c.breach.ok()) return std::unexpected(in_message_names(c.breach.result().error()));
  return scene;
}

}  // namespace crumple::scene_convert
