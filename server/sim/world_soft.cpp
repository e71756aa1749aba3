#include "common/text.h"
#include "server/sim/motion.h"
#include "server/sim/world_impl.h"

#include <algorithm>
#include <functional>
#include <utility>

// The stages around the implicit solve: prescribed motion, contact, assembly, composite islands, and what happens to
// finite-element bodies after it.
namespace crumple::sim {

void World::Impl::prescribe_motion() {
  for (SoftBody& body : soft) body.prescribe(time(), scene.dt);
  for (SolidBody& body : solids) {
    if (body.model.kind == RigidKind::kinematic && !body.model.motion.empty()) {
      rigid.set_target(body.id, pose_at(body.model.motion, time() + scene.dt));
    }
  }
  feel_scripts();
}

contact::CollisionBody World::Impl::collision_body(const SoftBody& body) const {
  return {.mesh = &body.collision, .x = body.state.x, .v = body.state.v, .fixed = body.fixed,
          .friction = body.material().friction, .origin = body.is_whole() ? -1 : static_cast<int>(body.id), .v_before = body.v_before,
          .self = body.self_contact ? &*body.self_contact : nullptr};
}

void World::Impl::place_for_contact() {
  collision_bodies.clear();
  collision_ids.clear();
  collision_parts.clear();
  planes.clear();
  for (const SoftBody& body : soft) {
    collision_bodies.push_back(collision_body(body));
    if (is_asleep(body)) collision_bodies.back().fixed = std::span(all_fixed).first(body.state.x.size());
    collision_ids.push_back(body.id);
    collision_parts.push_back(part_of(body));
  }
  const auto motion = [&](BodyId id) {
    return contact::RigidMotion{rigid.com(id), rigid.velocity(id), rigid.angular_velocity(id), rigid.mass(id), rigid.is_moving(id) && !is_asleep(body_part(id))};
  };
  for (SolidBody& body : solids) {
    planes.insert(planes.end(), body.planes.begin(), body.planes.end());
    if (body.proxy.tets.empty()) continue;
    if (body.model.kind != RigidKind::fixed) body.follow(rigid.pose(body.id));
    contact::RigidMotion moving = motion(body.id);
    if (body.model.kind == RigidKind::kinematic && !body.model.motion.empty()) {
      const Pose from = rigid.pose(body.id), to = pose_at(body.model.motion, time() + scene.dt);
      moving.v = (to.p_WB - from.p_WB) / scene.dt;
      moving.w = angular_velocity_between(from.R_WB, to.R_WB, scene.dt);
    }
    collision_bodies.push_back({.mesh = &body.collision, .x = body.x, .rigid = moving, .friction = body.model.friction});
    collision_ids.push_back(body.id);
    collision_parts.push_back(body_part(body.id));
  }
  for (ExampleBody& body : examples) {
    body.follow(rigid.pose(body.id));
    collision_bodies.push_back({.mesh = &body.collision, .x = body.x, .rigid = motion(body.id), .friction = body.friction});
    collision_ids.push_back(body.id);
    collision_parts.push_back(body_part(body.id));
  }
  first_debris = static_cast<int>(collision_bodies.size());
  soft_at_detection = static_cast<int>(soft.size());
  for (const Part part : debris) {
    collision_bodies.push_back(fragment(part).collision_body(is_asleep(part)));
    collision_ids.push_back(soft[piece(part).soft].id);
    collision_parts.push_back(part);
  }
}

void World::Impl::detect_contact(StepReport& report) {
  rows.clear();
  collision_bodies.clear();
  collision_ids.clear();
  collision_parts.clear();
  if (soft.empty() || workload().live_bodies == 0) return;
  do {  // again where sleepers woke: what they touch in turn
    place_for_contact();
    hide_far_sleepers();
    contact::detect({collision_bodies, planes, scene.gravity, scene.dt, scene.contact}, pool, detection, rows);
  } while (wake_touched());
  contact::append_lasting(lasting, collision_bodies, scene.dt, rows_found, rows);
  report.contacts = static_cast<int>(rows.size());
  report.worst_penetration = std::max(report.worst_penetration, contact::deepest(rows));
}

void World::Impl::assemble() {
  for (const contact::ContactRow& row : rows) {
    for (const contact::ContactSide& side : row.sides) {
      if (side.body < static_cast<int>(soft.size())) soft[side.body].restart();
    }
  }
  // Many small bodies fill the threads one each; the passes inside a large one do so themselves.
  const auto job = [&](int k) {
    switch (sleepers.activity(soft_parts[k])) {
      case islands::Activity::live: soft[k].assemble(scene.gravity, scene.dt, pool); break;
      case islands::Activity::kinematic: soft[k].assemble_kinematic(pool); break;
      case islands::Activity::asleep: break;
    }
  };
  pool.for_jobs(static_cast<int>(soft.size()), std::cref(job));
}

void World::Impl::set_unknowns(SoftBody& body, islands::IslandBody& unknowns) {
  unknowns.system = &body.system;
  unknowns.v_before = &body.v_before;
  unknowns.x = &body.state.x;
  unknowns.X = &body.X;
  unknowns.mean_tet_volume = body.mean_tet_volume;
  unknowns.hierarchy = &body.hierarchy;
  unknowns.rest = &body.rest;
  if (body.is_whole()) unknowns.factor = &body.factor;
}

void World::Impl::fill_island_bodies() {
  std::vector<islands::IslandBody>& bodies = island_bodies;
  bodies.resize(collision_bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bodies[b].clear();
    if (!is_live(part_of(static_cast<int>(b)))) continue;
    const BodyId id = collision_ids[b];
    if (is_debris(static_cast<int>(b))) {
      bodies[b] = debris_for_islands(static_cast<int>(b), scene.dt);
      continue;
    }
    if (b < soft.size()) {
      if (!soft[b].is_empty()) set_unknowns(soft[b], bodies[b]);
      continue;
    }
    if (!rigid.is_moving(id)) continue;
    islands::RigidPart part{.mass = rigid.mass(id), .p_WC = rigid.com(id), .inertia_W = rigid.inertia(id)};
    part.v = rigid.velocity(id);
    part.w = rigid.angular_velocity(id);
    part.b_v = rigid.momentum(id) + scene.dt * part.mass * scene.gravity;
    part.b_w = rigid.angular_momentum(id);
    bodies[b].rigid = part;
  }
}

islands::IslandOptions World::Impl::solve_options(const islands::CompositeIsland& island) const {
  islands::IslandOptions options{.solve = {0.5, 1}, .may_pull = scene.contact.raw_damping, .solver = scene.solver};
  const auto ask = [&](const SoftBody& body) {
    const double share = fem::remembers(body.state) ? fem::kBdf2Tolerance : 1;
    options.solve.tolerance = std::min(options.solve.tolerance, share * body.material().cg_tolerance);
    options.solve.max_iterations = std::max(options.solve.max_iterations, body.material().cg_max_iterations);
  };
  for (int b : island.soft) ask(soft[b]);
  for (int b : island.rigid)
    if (is_debris(b)) ask(parent_of(b));
  if (rung(island) >= guard::Rung::more_iterations) {
    options.solve.tolerance = std::max(1e-10, guard::kTolerance * options.solve.tolerance);
    options.solve.max_iterations *= guard::kIterations;
  }
  return options;
}

std::vector<contact::ContactRow> World::Impl::find_contact(std::span<const contact::CollisionBody> bodies, double dt,
                                                           const contact::LastingRows& going_on) const {
  std::vector<contact::ContactRow> found = contact::detect({bodies, planes, scene.gravity, dt, scene.contact}, pool);
  contact::RowIndex index;
  contact::append_lasting(going_on, bodies, dt, index, found);
  return found;
}

// Of the default law: the paper's knows the overlap of the moment alone.
void World::Impl::remember_lasting(const islands::CompositeIsland& island, double dt, contact::LastingRows& memory) const {
  if (!scene.contact.raw_damping) contact::remember_pushing(island.rows, soft_at_detection, dt, memory);
}

void World::Impl::solve(StepReport& report) {
  broken.assign(soft.size(), {});
  spent.assign(soft.size(), 0);
  if (soft.empty()) {
    composite.clear();
    accounts.clear();
    return;
  }
  fill_island_bodies();
  islands::composite_islands(island_bodies, rows, composite);
  rows.clear();
  accounts.resize(composite.size());
  if (composite.empty()) {  // what the friction of sleepers was stays remembered
    lasting.rows.clear();
    return;
  }
  // Islands that the guard lets take smaller steps, if there are any, come after the others; to part them allocates.
  const auto in_one_step = [&](const islands::CompositeIsland& island) { return rung(island) < guard::Rung::sub_steps; };
  std::size_t whole_count = composite.size();
  if (!std::ranges::all_of(composite, in_one_step))
    whole_count = static_cast<std::size_t>(std::stable_partition(composite.begin(), composite.end(), in_one_step) - composite.begin());
  for (std::size_t i = 0; i < composite.size(); ++i) open_account(composite[i], accounts[i]);
  const std::span<islands::CompositeIsland> in_one(composite.data(), whole_count);
  island_options.clear();
  for (const islands::CompositeIsland& island : in_one) island_options.push_back(solve_options(island));
  std::swap(friction, friction_before);
  friction.entries.clear();
  std::swap(lasting, lasting_before);
  lasting.rows.clear();
  const contact::FrictionMemory& before = friction_before;
  islands::solve_all(in_one, island_bodies, island_options, before, pool, solve_memories, solutions);
  broken_up.resize(whole_count);
  const auto break_up = [&](int i) { broken_up[i] = solve_breaking(composite[i], solutions[i], before); };
  pool.for_jobs(static_cast<int>(whole_count), std::cref(break_up));
  const auto finish = [&](const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                          std::span<const islands::IslandBody> bodies, IslandAccount& account) {
    account_contact(island, solution, bodies, account);
    take(island, solution, scene.dt, account, report);
    contact::remember_friction(island.rows, friction);
    remember_lasting(island, scene.dt, lasting);
  };
  for (std::size_t i = 0; i < whole_count; ++i) {
    if (broken_up[i].empty()) finish(composite[i], solutions[i], island_bodies, accounts[i]);
    for (const Solved& part : broken_up[i]) finish(part.island, part.solution, part.bodies, accounts[i]);
    broken_up[i].clear();
  }
  for (std::size_t i = whole_count; i < composite.size(); ++i) sub_step(composite[i], before, accounts[i], report);
  keep_friction_of_sleepers(before);
  friction.make_index();
  for (const Part part : debris) fragment(part).forget_pushes();
  const auto was_rough = [&](const Piece& piece) {
    const SoftBody& mesh = soft[piece.soft];
    return !piece.is_rigid() && is_live(mesh) && !mesh.is_empty() && mesh.was_rough();
  };
  for (const FemObject& object : objects) report.rough_bodies += std::ranges::any_of(object.pieces(), was_rough);
}

void World::Impl::follow_scripts() {
  for (SoftBody& body : soft) {
    if (sleepers.activity(part_of(body)) == islands::Activity::kinematic) body.follow_script(scene.dt);
  }
}

// What a solve over h [s] means for bodies, reports and events.
void World::Impl::take(const islands::CompositeIsland& island, const islands::IslandSolution& solution, double h,
                       IslandAccount& account, StepReport& report) {
  report.solver_iterations += solution.report.iterations;
  report.worst_residual = std::max(report.worst_residual, solution.report.residual);
  const bool capped = !solution.report.converged;
  if (capped) ++report.capped_solves;
  account.capped = account.capped || capped;
  account.residual = std::max(account.residual, solution.report.residual);
  for (std::size_t k = 0; k < island.soft.size(); ++k) {
    const int b = island.soft[k];
    if (capped && !was_capped[b] && !is_said(EventKind::solver, soft[b].id, "")) {
      Event& event = add_event(EventKind::solver, soft[b].id);
      event.magnitude = solution.report.residual;
      event.message = text("solve of ", scene.bodies[soft[b].id].name, " ended after ", solution.report.iterations,
                           " iterations with relative residual ", solution.report.residual);
    }
    was_capped[b] = capped;
    if (!soft[b].advance(solution.soft_velocity(static_cast<int>(k)), h)) {
      guards[b].rung = guard::Rung::frozen;
      Event& event = add_event(EventKind::frozen, soft[b].id);
      event.point = soft[b].centre_of_mass();
      event.message = text(scene.bodies[soft[b].id].name, " left the range of finite numbers and is held where it last was");
    }
  }
  for (const islands::RigidVelocity& after : solution.rigid)
    if (is_debris(after.body)) fragment_of(after.body).advance(after.v, after.w, h);
  for (const islands::ContactImpulse& contact : solution.impulses) {
    if (is_debris(contact.body)) continue;
    const BodyId id = collision_ids[contact.body];
    rigid.apply_impulse(id, contact.impulse_W, contact.point_W);
    if (places[id].model != BodyModel::example_based) continue;
    const Pose X_WB = rigid.pose(id);
    const Quat R_BW = X_WB.R_WB.conjugate();
    examples[places[id].index].strike(R_BW * (contact.point_W - X_WB.p_WB), R_BW * contact.impulse_W);
  }
}

void World::Impl::plastic_flow() {
  for (SoftBody& body : soft) {
    if (!is_asleep(body)) body.plastic_flow(scene.dt, scene.creep_dt, pool);
  }
}

void World::Impl::fracture(StepReport& report) {
  breakable.clear();
  for (int b = 0; b < static_cast<int>(soft.size()); ++b)
    if (soft[b].rest.breakable() && !is_asleep(soft[b])) breakable.push_back(b);
  if (breakable.empty()) return;
  const auto break_one = [&](int k) { broken[breakable[k]] += soft[breakable[k]].fracture(scene.seed, step, pool); };
  pool.for_jobs(static_cast<int>(breakable.size()), std::cref(break_one));
  std::vector<FractureOutcome> outcome;  // one an object, if anything breaks
  std::vector<int> broke;
  for (const int b : breakable) {
    if (broken[b].splits == 0) continue;
    outcome.resize(objects.size());
    const int object = places[soft[b].id].index;
    if (outcome[object].splits == 0) broke.push_back(object);
    outcome[object] += broken[b];
    report.splits += broken[b].splits;
  }
  std::ranges::sort(broke);
  for (const int k : broke) {
    const BodyId id = objects[k].id();
    Event& event = add_event(EventKind::fracture, id);
    event.point = outcome[k].point;
    event.count = outcome[k].splits;
    event.fragments = objects[k].connected_pieces(soft);
    event.message = text(scene.bodies[id].name, " breaks: ", event.count, " splits, ", event.fragments, " pieces");
  }
  hand_over();  // what was drawn before is drawn as it was
  if (broke.empty()) return;
  std::vector<BodyTopology> drawn(broke.size());
  pool.for_jobs(static_cast<int>(broke.size()), [&](int k) {
    objects[broke[k]].draw(soft);
    drawn[k] = objects[broke[k]].topology(soft);
  });
  for (std::size_t k = 0; k < broke.size(); ++k) {
    FemObject& object = objects[broke[k]];
    BodyTopology& known = topology.bodies[object.id()];
    if (drawn[k].triangles != known.triangles || drawn[k].vertices.size() != known.vertices.size()) {  // not where nothing shows of it
      drawn[k].epoch = topology.epoch + 1;
      known = std::move(drawn[k]);
    }
    std::vector<DustParticle> grains = object.take_dust(soft, scene.seed, step);
    if (grains.empty()) continue;
    Event& event = add_event(EventKind::dust, object.id());
    event.count = static_cast<int>(grains.size());
    event.point = grains.front().position.cast<double>();
    event.message = text(event.count, " grains of dust from ", scene.bodies[object.id()].name);
    event.particles = std::move(grains);
  }
  ++topology.epoch;
  add_event(EventKind::topology, 0).message = text("drawn topology ", topology.epoch);
}

}  // namespace crumple::sim
