#include "server/lab/stability/contact_trial.h"

#include "common/text.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/lab/stability/step_times.h"
#include "server/sim/contact/detect.h"
#include "server/sim/fem/rest_body.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace crumple::lab::stability {

namespace {

constexpr double kFar = 1e4;  // [m]
constexpr double kGravity = 9.81;

// A box's lattice with its squares pressed into discs (elliptical grid mapping).
sim::TetMesh disc_mesh(double diameter, double thickness, const std::array<int, 3>& cells) {
  sim::TetMesh mesh = *authoring::centred_box_mesh({2, thickness, 2}, cells, authoring::Lattice::kuhn);
  for (Vec3& X : mesh.X) {
    const double u = X.x(), v = X.z();
    X.x() = 0.5 * diameter * u * std::sqrt(1 - 0.5 * v * v);
    X.z() = 0.5 * diameter * v * std::sqrt(1 - 0.5 * u * u);
  }
  return mesh;
}

}  // namespace

ContactTrial::ContactTrial(const ContactMethod& method_, double dt) : method(method_) {
  scene.dt = dt;
  scene.contact = method.settings;
  scene.integrator = method.integrator;
  scene.unguarded = !method.guarded;  // what the method does by itself
  scene.sleep.speed = 0;              // so that rest is the method's, too
}

BodyId ContactTrial::add_block(const BlockOptions& block) {
  sim::BodyDescription body{.name = text("block ", scene.bodies.size()),
                            .velocity = block.velocity,
                            .angular_velocity = block.angular_velocity};
  body.pose = {Quat(Eigen::AngleAxisd(block.turned, Vec3::UnitY())), block.centre};
  if (method.rigid) {
    sim::RigidModel model;
    if (block.round)
      model.shapes.push_back({Pose{}, sim::Cylinder{block.size.x() / 2, block.size.y() / 2}});
    else
      model.shapes.push_back({Pose{}, sim::Box{block.size / 2}});
    model.density = block.density;
    model.friction = friction;
    model.restitution = 0;
    body.model = model;
  } else {
    sim::FemModel model;
    model.mesh = std::make_shared<sim::TetMesh>(
        block.round ? disc_mesh(block.size.x(), block.size.y(), block.cells)
                    : *authoring::centred_box_mesh(block.size, block.cells, authoring::Lattice::kuhn));
    model.clamp_limit = block.clamp_limit;
    model.element = method.element;
    model.material.young = block.young;
    model.material.density = block.density;
    model.material.friction = friction;
    model.material.cg_tolerance = solver_tolerance;
    model.material.cg_max_iterations = 2000;
    if (method.material) method.material(model.material);
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
  std::vector<double> times;
  for (long k = 0; k < steps && sound(); ++k) {
    const double from = processor_time();
    const sim::StepReport report = step();
    times.push_back(processor_time() - from);
    if (after_step && !after_step(report)) break;
  }
  if (method.times) method.times->add(std::move(times));
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
  const Eigen::RowVector3d up = pose.R_WB.toRotationMatrix().row(1);  // of W, in the body's axes
  const sim::Shape& shape = std::get<sim::RigidModel>(scene.bodies[body].model).shapes[0].shape;
  if (const auto* disc = std::get_if<sim::Cylinder>(&shape))
    return pose.p_WB.y() - disc->half_length * std::abs(up.y()) - disc->radius * std::hypot(up.x(), up.z());
  return pose.p_WB.y() - up.cwiseAbs().dot(std::get<sim::Box>(shape).half_extents);
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

namespace {

// Lower face of a body at the first overlap with the plate that the paper's rule sees; nothing: it never sees one.
std::optional<double> seen_by_sixth_rule(const ShotOptions& shot, double start) {
  const double way = shot.speed * shot.dt, part = shot.size.norm() / 6;
  const long sub_steps = way > part ? static_cast<long>(way / part) + 1 : 1;
  for (long k = 1;; ++k) {
    const double lower = start - static_cast<double>(k) * way / static_cast<double>(sub_steps);
    if (lower + shot.size.y() < -shot.thickness) return std::nullopt;
    if (lower < 0) return lower;
  }
}

}  // namespace

Shot shot_at_plate(const ContactMethod& method, const ShotOptions& options) {
  ContactTrial trial(method, options.dt);
  trial.scene.gravity.setZero();
  trial.add_plate({4, options.thickness, 4}, {0, -options.thickness / 2, 0});
  const double dt = options.dt, speed = options.speed;
  double start = 0.01 + (1 + options.phase) * speed * dt;  // of the lower face
  if (options.sixth_rule) {
    const auto seen = seen_by_sixth_rule(options, start);
    if (!seen) return {.sound = true, .behind = true};
    start = *seen;
  }
  const bool flat = options.size.y() < 0.1 * options.size.x();
  const int across = options.round ? 4 : 2;
  const BodyId block = trial.add_block({.size = options.size,
                                        .centre = {0, options.size.y() / 2 + start, 0},
                                        .velocity = {0, -speed, 0},
                                        .cells = {across, flat ? 1 : 2, across},
                                        .young = 1e7,
                                        .round = options.round});
  trial.start();
  Shot shot;
  trial.run(std::max(10 * dt, std::min(0.5, 4 / speed)) + 4 * dt, [&](const sim::StepReport&) {
    shot.rebound = std::max(shot.rebound, trial.velocity(block).y() / speed);
    return true;
  });
  shot.sound = trial.sound();
  shot.behind = trial.centre(block).y() < -options.thickness;
  shot.penetration = std::max(0.0, -trial.lowest(block));
  return shot;
}

Spun spun_at_plate(const ContactMethod& method, double rate, double dt, double seconds) {
  constexpr double kThickness = 0.01, kHeight = 0.3;
  ContactTrial trial(method, dt);
  trial.scene.gravity.setZero();
  trial.add_plate({4, kThickness, 4}, {0, -kThickness / 2, 0});
  const BodyId disc = trial.add_block({.size = {1, 0.01, 1},
                                       .centre = {0, kHeight, 0},
                                       .angular_velocity = {rate, 0, 0},
                                       .cells = {4, 1, 4},
                                       .young = 1e9,
                                       .round = true,
                                       .clamp_limit = 1e9});
  trial.start();
  Spun result{.deepest = -kHeight};
  trial.run(seconds, [&](const sim::StepReport&) {
    const double depth = -trial.lowest(disc);
    result.through += depth > kThickness;
    result.deepest = std::max(result.deepest, depth);
    return true;
  });
  result.sound = trial.sound();
  return result;
}

}  // namespace crumple::lab::stability
