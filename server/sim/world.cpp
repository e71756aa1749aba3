#include "server/sim/world.h"

#include "server/sim/fem/elements.h"
#include "server/sim/world_impl.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim {

World::World() = default;
World::~World() = default;

Result<std::unique_ptr<World>> World::create(const SceneDescription& scene, const WorldOptions& options) {
  assert(options.threads >= 1);
  if (auto valid = validate(scene); !valid) return std::unexpected(valid.error());
  std::unique_ptr<World> world(new World);
  RigidSettings rigid{.gravity = scene.gravity, .iterations = scene.rigid_iterations};
  if (options.rigid_tolerance > 0) rigid.tolerance = options.rigid_tolerance;
  world->impl_ = std::make_unique<Impl>(options, rigid);
  world->impl_->scene = scene;
  world->impl_->script = scene.script;
  if (auto made = world->impl_->make_bodies(); !made) return std::unexpected(made.error());
  return world;
}

// One step: the table of contents of docs/architecture.md.
StepReport World::step() {
  Impl& w = *impl_;
  StepReport report{.step = w.step};
  w.stage_times.clear();
  w.timed("commands", [&] { w.apply_commands(); });
  w.timed("kinematic", [&] { w.prescribe_motion(); });
  w.timed("detect", [&] { w.detect_contact(report); });
  w.timed("assemble", [&] { w.assemble(); });
  w.timed("guard", [&] { w.watch(); });
  w.timed("solve", [&] { w.solve(report), w.follow_scripts(); });
  w.timed("rigid", [&] { w.step_rigid(report); });
  w.timed("examples", [&] { w.deform_examples(report); });
  w.timed("plasticity", [&] { w.plastic_flow(); });
  w.timed("fracture", [&] { w.fracture(report); });
  w.timed("sleep", [&] { w.settle(report); });
  ++w.step;
  return report;
}

void World::set_clock(double (*now_ms)()) {
  impl_->now_ms = now_ms;
  for (ExampleBody& body : impl_->examples) body.set_clock(now_ms);
}
const std::vector<Strike>& World::strikes() const { return impl_->strikes; }
const example_based::ExampleTimes& World::example_times() const { return impl_->example_times; }
const std::vector<StageTime>& World::stage_times() const { return impl_->stage_times; }
double World::time() const { return impl_->time(); }
std::uint64_t World::step_count() const { return impl_->step; }
double World::dt() const { return impl_->scene.dt; }
int World::body_count() const { return static_cast<int>(impl_->places.size()); }

BodyId World::find(const std::string& name) const {
  const auto& bodies = impl_->scene.bodies;
  const auto at = std::find_if(bodies.begin(), bodies.end(), [&](const BodyDescription& b) { return b.name == name; });
  return static_cast<BodyId>(at - bodies.begin());
}

Pose World::pose(BodyId body) const {
  const Impl::Place place = impl_->places[body];
  if (place.model == BodyModel::fem) return {Quat::Identity(), impl_->objects[place.index].centre_of_mass(impl_->soft)};
  return impl_->rigid.pose(body);
}

Vec3 World::velocity(BodyId body) const {
  const Impl::Place place = impl_->places[body];
  if (place.model != BodyModel::fem) return impl_->rigid.velocity(body);
  const FemObject& object = impl_->objects[place.index];
  return object.momentum(impl_->soft) / object.mass(impl_->soft);
}

bool World::is_asleep(BodyId body) const { return impl_->sleeps(body); }
Workload World::workload() const { return impl_->workload(); }

Energies World::energies() const {
  Energies total;
  for (const SoftBody& soft : impl_->soft) {
    for (int n = 0; n < soft.node_count(); ++n) {
      const Vec3 p = soft.rest.node_mass[n] * soft.state.v[n];
      total.kinetic += 0.5 * p.dot(soft.state.v[n]);
      total.gravitational -= soft.rest.node_mass[n] * impl_->scene.gravity.dot(soft.state.x[n]);
      total.momentum += p;
      total.angular_momentum += soft.state.x[n].cross(p);
    }
    for (const RigidFragment& fragment : soft.fragments) {
      const Vec3 p = fragment.mass() * fragment.velocity();
      total.kinetic += fragment.kinetic_energy();
      total.gravitational -= fragment.mass() * impl_->scene.gravity.dot(fragment.com());
      total.momentum += p;
      total.angular_momentum += fragment.angular_momentum() + fragment.com().cross(p);
    }
    total.elastic += fem::elastic_energy(soft.rest, soft.tets, soft.state.x, soft.state.plastic_strain);
  }
  for (BodyId id = 0; id < impl_->places.size(); ++id) {
    if (impl_->places[id].model == BodyModel::fem || !impl_->rigid.is_moving(id)) continue;
    const RigidWorld& rigid = impl_->rigid;
    total.kinetic += rigid.kinetic_energy(id);
    total.gravitational -= rigid.mass(id) * impl_->scene.gravity.dot(rigid.com(id));
    total.momentum += rigid.momentum(id);
    total.angular_momentum += rigid.angular_momentum(id) + rigid.com(id).cross(rigid.momentum(id));
  }
  return total;
}

int World::inverted(BodyId body) const {
  assert(impl_->places[body].model == BodyModel::fem);
  int count = 0;
  for (const Piece& piece : impl_->objects[impl_->places[body].index].pieces()) {
    const SoftBody& mesh = impl_->soft[piece.soft];
    if (!piece.is_rigid()) count += fem::inverted_count(mesh.tets, mesh.state.x, impl_->pool);
  }
  return count;
}

FemView World::fem(BodyId body) const {
  assert(impl_->places[body].model == BodyModel::fem);
  const FemObject& object = impl_->objects[impl_->places[body].index];
  const SoftShape shape = object.shape(impl_->soft);
  FemView view;
  view.fragments = object.connected_pieces(impl_->soft);
  view.rigid_fragments = object.rigid_pieces();
  view.inverted = inverted(body);
  const int pieces = static_cast<int>(shape.pieces.size());
  std::vector<int> first_node(pieces);
  std::vector<std::vector<double>> stress(pieces);
  for (const bool rigid : {false, true}) {
    for (int p = 0; p < pieces; ++p) {
      if (shape.is_rigid(p) != rigid) continue;
      first_node[p] = static_cast<int>(view.x.size());
      const std::span<const Vec3> x = shape.x(p);
      view.x.insert(view.x.end(), x.begin(), x.end());
      for (int n = 0; n < static_cast<int>(x.size()); ++n) view.v.push_back(shape.velocity({p, n}));
      if (!rigid) stress[p] = shape.mesh_of(p).von_mises();
    }
  }
  const bool heterogeneous = shape.mesh_of(0).rest.material_count() > 1;
  for (const TetRef& at : shape.scene_tets) {
    Tet tet = shape.nodes(at);
    for (int& n : tet) n += first_node[at.piece];
    view.tets.push_back(tet);
    view.plastic_strain.push_back(shape.plastic_strain(at));
    if (heterogeneous) view.material_id.push_back(shape.material_id(at));
    view.von_mises.push_back(shape.is_rigid(at.piece) ? 0 : stress[at.piece][at.tet]);
  }
  return view;
}

const example_based::WeightMatrix& World::example_weights(BodyId body) const {
  assert(impl_->places[body].model == BodyModel::example_based);
  return impl_->examples[impl_->places[body].index].state.E;
}

std::uint64_t World::state_hash() const {
  StateHash hash;
  hash.add(impl_->step);
  for (const SoftBody& soft : impl_->soft) soft.hash(hash);
  for (const ExampleBody& example : impl_->examples) example.hash(hash);
  std::vector<double> rigid;
  impl_->rigid.append_state(rigid);
  hash.add(std::span<const double>(rigid));
  for (const auto& held : impl_->friction.entries) {
    for (int key : held.key) hash.add(static_cast<std::uint64_t>(key));
    hash.add(held.impulse);
    hash.add(static_cast<std::uint64_t>(held.slid));
  }
  impl_->lasting.hash(hash);
  for (const Impl::ActiveForce& force : impl_->forces) hash.add(force.left);
  for (const LoadWindow& window : impl_->joint_loads) {
    for (const JointLoad& load : window.kept()) hash.add(load.impulse), hash.add(load.couple);
    hash.add(static_cast<std::uint64_t>(window.at()));
  }
  impl_->sleepers.hash(hash);
  for (const islands::Stillness& stillness : impl_->stillness) stillness.hash(hash);
  for (const guard::BodyGuard& guard : impl_->guards) {
    hash.add(static_cast<std::uint64_t>(guard.rung));
    for (double energy : {guard.surplus, guard.jump, guard.energy, guard.energy_at_alarm}) hash.add(energy);
    for (int steps : {guard.growing_steps, guard.inverted_steps, guard.capped_steps, guard.steps_on_rung, guard.calm_steps}) {
      hash.add(static_cast<std::uint64_t>(steps));
    }
  }
  return hash.value();
}

}  // namespace crumple::sim
