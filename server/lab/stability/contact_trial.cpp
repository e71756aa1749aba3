#include "server/lab/stability/contact_trial.h"

#include "common/text.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/sim/contact/detect.h"
#include "server/sim/fem/rest_body.h"

#include <algorithm>
#include <cmath>

namespace crumple::lab::stability {

namespace {

constexpr double kFar = 1e4;  // [m]
constexpr double kGravity = 9.81;

}  // namespace

ContactTrial::ContactTrial(const ContactMethod& method_, double dt) : method(method_) {
  scene.dt = dt;
  scene.contact = method.settings;
  scene.unguarded = true;  // what the method does by itself
}

BodyId ContactTrial::add_block(const BlockOptions& block) {
  sim::BodyDescription body{.name = text("block ", scene.bodies.size()), .velocity = block.velocity};
  body.pose.p_WB = block.centre;
  if (method.rigid) {
    sim::RigidModel model;
    model.shapes.push_back({Pose{}, sim::Box{block.size / 2}});
    model.density = block.density;
    model.friction = friction;
    model.restitution = 0;
    body.model = model;
  } else {
    sim::FemModel model;
    model.mesh =
        std::make_shared<sim::TetMesh>(*authoring::centred_box_mesh(block.size, block.cells, authoring::Lattice::kuhn));
    model.material.young = block.young;
    model.material.density = block.density;
    model.material.friction = friction;
    model.material.cg_tolerance = solver_tolerance;
    model.material.cg_max_iterations = 2000;
    body.model = model;
  }
  scene.bodies.push_back(body);
  blocks.push_back(static_cast<BodyId>(scene.bodies.size() - 1));
  return blocks.back();
}

BodyId ContactTrial::add_plate(const Vec3& size, const Vec3& centre) {
  sim::BodyDescription body{.name = text("plate ", scene.bodies.size())};
  body.pose.p_WB = centre;
  sim::RigidModel model{.kind = sim::RigidKind::fixed, .friction = friction, .restitution = 0};
  model.shapes.push_back({Pose{}, sim::Box{size / 2}});
  body.model = model;
  scene.bodies.push_back(body);
  plates.push_back(static_cast<BodyId>(scene.bodies.size() - 1));
  return plates.back();
}

void ContactTrial::add_ground() {
  sim::RigidModel model{.kind = sim::RigidKind::fixed, .friction = friction, .restitution = 0};
  model.shapes.push_back({Pose{}, sim::Plane{}});
  scene.bodies.push_back({.name = "ground", .model = model});
  ground = true;
}

void ContactTrial::start() { world = std::move(sim::World::create(scene).value()); }

sim::StepReport ContactTrial::step() {
  if (method.push) method.push(*this);
  const sim::StepReport report = world->step();
  for (const sim::Event& event : world->take_events()) frozen = frozen || event.kind == sim::EventKind::frozen;
  worst_penetration = std::max(worst_penetration, report.worst_penetration);
  capped += report.capped_solves;
  return report;
}

void ContactTrial::run(double seconds, const std::function<bool(const sim::StepReport&)>& after_step) {
  worst_penetration = 0;
  capped = 0;
  const long steps = std::max(1L, std::lround(seconds / scene.dt));
  for (long k = 0; k < steps && sound(); ++k) {
    const sim::StepReport report = step();
    if (after_step && !after_step(report)) return;
  }
}

double ContactTrial::rms_speed(BodyId body) const {
  if (method.rigid) return world->velocity(body).norm();
  const sim::FemView view = world->fem(body);
  double sum = 0;
  for (const Vec3& v : view.v) sum += v.squaredNorm();
  return std::sqrt(sum / static_cast<double>(view.v.size()));
}

double ContactTrial::lowest(BodyId body) const {
  if (!method.rigid) {
    const sim::FemView view = world->fem(body);
    return std::ranges::min_element(view.x, {}, [](const Vec3& x) { return x.y(); })->y();
  }
  const Pose pose = world->pose(body);
  const Vec3 half =
      std::get<sim::Box>(std::get<sim::RigidModel>(scene.bodies[body].model).shapes[0].shape).half_extents;
  return pose.p_WB.y() - pose.R_WB.toRotationMatrix().row(1).cwiseAbs().dot(half);
}

int ContactTrial::inverted() const {
  int sum = 0;
  if (method.rigid) return sum;
  for (const BodyId body : blocks) sum += world->fem(body).inverted;
  return sum;
}

double ContactTrial::energy() const {
  const sim::Energies e = world->energies();
  return e.kinetic + e.elastic + e.gravitational;
}

bool ContactTrial::sound() const {
  return !frozen && std::ranges::all_of(blocks, [&](BodyId body) {
    const Vec3 c = centre(body);
    return c.allFinite() && c.cwiseAbs().maxCoeff() < kFar && velocity(body).allFinite();
  });
}

void push_by_penalty(ContactTrial& trial) {
  constexpr double kPressure = 1e6;  // [Pa/m]: a block of 1 m sinks in by 1 cm; much more is unstable at dt = 1/60
  std::vector<sim::contact::CollisionMesh> meshes;
  std::vector<sim::FemView> views;
  std::vector<std::vector<Vec3>> plate_nodes;
  for (const BodyId body : trial.blocks) {
    const auto& model = std::get<sim::FemModel>(trial.scene.bodies[body].model);
    const auto rest = sim::fem::make_rest_body(*model.mesh, model.material).value();
    std::vector<double> mass;
    for (const double volume : rest.volume) mass.push_back(model.material.density * volume);
    meshes.push_back(sim::contact::make_collision_mesh(model.mesh->tets, model.mesh->X, mass));
    views.push_back(trial.world->fem(body));
  }
  for (const BodyId body : trial.plates) {
    const auto& model = std::get<sim::RigidModel>(trial.scene.bodies[body].model);
    const sim::TetMesh box = *authoring::centred_box_mesh(2 * std::get<sim::Box>(model.shapes[0].shape).half_extents,
                                                          {1, 1, 1}, authoring::Lattice::kuhn);
    meshes.push_back(sim::contact::make_collision_mesh(box.tets, box.X, {}));
    plate_nodes.emplace_back();
    for (const Vec3& X : box.X) plate_nodes.back().push_back(trial.scene.bodies[body].pose * X);
  }
  std::vector<sim::contact::CollisionBody> bodies;
  for (std::size_t k = 0; k < views.size(); ++k)
    bodies.push_back({.mesh = &meshes[k], .x = views[k].x, .v = views[k].v});
  for (std::size_t k = 0; k < plate_nodes.size(); ++k)
    bodies.push_back(
        {.mesh = &meshes[views.size() + k], .x = plate_nodes[k], .rigid = sim::contact::RigidMotion{.movable = false}});
  std::vector<sim::contact::CollisionPlane> planes;
  if (trial.ground) planes.push_back({});

  const sim::ThreadPool pool(1);
  const double dt = trial.scene.dt;
  for (const auto& row : sim::contact::detect({bodies, planes, trial.scene.gravity, dt, {.raw_damping = true}}, pool)) {
    const Vec3 impulse = dt * kPressure * std::max(0.0, row.depth) * row.area * row.normal;
    for (const auto& side : row.sides)
      for (int k = 0; k < side.node_count; ++k)
        (void)trial.world->submit(
            sim::ApplyNodeImpulse{trial.blocks[side.body], {side.nodes[k]}, side.weights[k] * impulse});
  }
}

HeavyOnLight heavy_on_light(const ContactMethod& method, double ratio, double dt, double seconds) {
  ContactTrial trial(method, dt);
  trial.solver_tolerance = 1e-3;
  trial.add_ground();
  const BodyId light = trial.add_block({.centre = {0, 0.5, 0}, .young = 1e9, .density = 100});
  const BodyId heavy = trial.add_block({.centre = {0, 1.5, 0}, .young = 1e9, .density = 100 * ratio});
  trial.start();
  trial.run(2 * seconds / 3);
  HeavyOnLight result;
  double before = trial.energy();
  const double scale = 100 * ratio * kGravity;  // of a metre
  trial.run(seconds / 3, [&](const sim::StepReport&) {
    result.speed = std::max({result.speed, trial.rms_speed(light), trial.rms_speed(heavy)});
    const double now = trial.energy();
    result.energy_rise = std::max(result.energy_rise, (now - before) / scale);
    before = now;
    return true;
  });
  result.penetration = trial.worst_penetration;
  result.sound = trial.sound();
  result.inverted = trial.inverted();
  result.fell = !(trial.centre(heavy).y() > trial.centre(light).y() + 0.5);
  return result;
}

Shot shot_at_plate(const ContactMethod& method, const Vec3& size, double speed, double thickness, double dt,
                   double phase) {
  ContactTrial trial(method, dt);
  trial.scene.gravity.setZero();
  trial.add_plate({4, thickness, 4}, {0, -thickness / 2, 0});
  const double way = speed * dt;
  const BodyId block = trial.add_block({.size = size,
                                        .centre = {0, size.y() / 2 + 0.01 + (1 + phase) * way, 0},
                                        .velocity = {0, -speed, 0},
                                        .cells = {2, size.y() < 0.1 * size.x() ? 1 : 2, 2},
                                        .young = 1e7});
  trial.start();
  Shot shot;
  trial.run(std::max(10 * dt, std::min(0.5, 4 / speed)) + 4 * dt, [&](const sim::StepReport&) {
    shot.rebound = std::max(shot.rebound, trial.velocity(block).y() / speed);
    return true;
  });
  shot.sound = trial.sound();
  shot.behind = trial.centre(block).y() < -thickness;
  shot.penetration = std::max(0.0, -trial.lowest(block));
  return shot;
}

}  // namespace crumple::lab::stability
