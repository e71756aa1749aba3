#include "common/text.h"
#include "server/sim/world_impl.h"

#include <algorithm>

// The stage that looks at what the last step did, island by island, and what it asks of this one (guard/island_guard.h).
namespace crumple::sim {

guard::Rung World::Impl::rung(const islands::CompositeIsland& island) const {
  guard::Rung highest = guard::Rung::normal;
  for (int b : island.soft) {
    if (guards[b].rung != guard::Rung::frozen) highest = std::max(highest, guards[b].rung);
  }
  return highest;
}

void World::Impl::open_account(const islands::CompositeIsland& island, IslandAccount& account) const {
  account.soft = island.soft;
  account.energy = account.work = account.residual = 0;
  account.capped = false;
  for (int b : island.soft) {
    if (!soft[b].frozen) account.energy += soft_energy[b].moving + soft_energy[b].gravitational;
  }
}

void World::Impl::watch() {
  soft_energy.assign(soft.size(), {});
  if (!scene.unguarded) look_at_accounts();
  for (SoftBody& body : soft) body.begin_account();
}

void World::Impl::look_at_accounts() {
  for (std::size_t b = 0; b < soft.size(); ++b) {
    if (!soft[b].frozen && is_live(soft[b])) soft_energy[b] = soft[b].energy(scene.gravity);
  }
  for (const IslandAccount& account : accounts) {
    guard::Measurement island{.capped = account.capped, .residual = account.residual};
    double now = 0, work = account.work;
    bool holds = true;
    for (int b : account.soft) {
      if (soft[b].frozen) {
        holds = false;  // what it did to the others is not counted
        continue;
      }
      now += soft_energy[b].moving + soft_energy[b].gravitational;
      island.energy += soft_energy[b].moving;
      island.mass += soft[b].rest.mass();
      work += soft[b].command_work() + soft[b].prescribed_work();
      holds = holds && soft[b].balance_holds();
    }
    if (holds) island.surplus = now - account.energy - work;
    island.energy += std::abs(work);
    for (int b : account.soft) {
      if (soft[b].frozen) continue;
      guard::Measurement own = island;
      // What has just fallen asleep moved after its last pass over the elements.
      own.inverted = is_live(soft[b]) ? soft[b].inverted(pool) : fem::inverted_count(soft[b].tets, soft[b].state.x, pool);
      const auto found = guard::watch(own, guards[b]);
      if (!found) continue;
      soft[b].use_rotation(found->rung >= guard::Rung::safe_rotation);
      const std::string& name = scene.bodies[soft[b].id].name;
      const std::string now = text("; now ", guard::name(found->rung));
      if (!is_said(EventKind::guard, soft[b].id, now)) {
        Event& event = add_event(EventKind::guard, soft[b].id);
        event.point = soft[b].centre_of_mass();
        event.magnitude = found->value;
        event.message = found->up ? text(name, ": ", guard::name(found->quantity), " is ", found->value, ", at most ", found->bound,
                                         " is allowed", now)
                                  : text(name, " is calm again", now);
      }
      if (found->rung != guard::Rung::frozen) continue;
      soft[b].freeze();
      add_event(EventKind::frozen, soft[b].id).message = text(name, " gains energy that nothing gives it and is held where it is");
    }
  }
}

void World::Impl::sub_step(const islands::CompositeIsland& island, const contact::FrictionMemory& before,
                           IslandAccount& account, StepReport& report) {
  const double h = scene.dt / guard::kSubSteps;
  auto [bodies, unknowns] = alone(island);
  for (int b : island.soft) unknowns[b].factor = nullptr;  // another dt: not worth a factor of its own
  std::vector<std::vector<Vec3>> rigid_x(bodies.size());
  std::vector<int> own;  // rigid bodies that the rigid stage will move
  for (int b : island.rigid) {
    if (is_debris(b)) continue;
    own.push_back(b);
    rigid_x[b].assign(bodies[b].x.begin(), bodies[b].x.end());
    bodies[b].x = rigid_x[b];
  }
  contact::FrictionMemory memory = before;
  contact::LastingRows going_on = lasting_before;
  for (int part = 0; part < guard::kSubSteps; ++part) {
    for (int b : island.rigid) {
      if (!is_debris(b)) continue;
      unknowns[b] = debris_for_islands(b, h);
      bodies[b] = fragment_of(b).collision_body(false);
    }
    for (int b : own) {
      islands::RigidPart& rigid_part = *unknowns[b].rigid;
      rigid_part.p_WC = bodies[b].rigid->p_WC;
      rigid_part.b_v = rigid_part.mass * (rigid_part.v + h * scene.gravity);
      rigid_part.b_w = rigid_part.inertia_W * rigid_part.w;
      bodies[b].rigid->v = rigid_part.v;
      bodies[b].rigid->w = rigid_part.w;
    }
    for (int b : island.soft) soft[b].assemble_part(scene.gravity, h, pool);
    auto now = islands::composite_islands(unknowns, find_contact(bodies, h, going_on));
    going_on.rows.clear();
    for (int b : own) unknowns[b].rigid->v += h * scene.gravity;  // stands where nothing touches it
    contact::FrictionMemory next;
    for (islands::CompositeIsland& piece : now) {
      const islands::IslandSolution solution = islands::solve(piece, unknowns, solve_options(piece), memory, pool);
      contact::remember_friction(piece.rows, next);
      remember_lasting(piece, h, going_on);
      account_contact(piece, solution, unknowns, account);
      take(piece, solution, h, account, report);
      for (const islands::RigidVelocity& after : solution.rigid) {
        unknowns[after.body].rigid->v = after.v;
        unknowns[after.body].rigid->w = after.w;
      }
    }
    next.make_index();
    memory = std::move(next);
    for (int b : own) {  // also those that touch nothing in this part
      const islands::RigidPart& moved = *unknowns[b].rigid;
      contact::RigidMotion& motion = *bodies[b].rigid;
      for (Vec3& x : rigid_x[b]) x += h * (moved.v + moved.w.cross(x - motion.p_WC));
      motion.p_WC += h * moved.v;
    }
  }
  friction.entries.insert(friction.entries.end(), memory.entries.begin(), memory.entries.end());
  lasting.rows.insert(lasting.rows.end(), going_on.rows.begin(), going_on.rows.end());
}

}  // namespace crumple::sim
