#include "server/sim/motion.h"
#include "server/sim/world_impl.h"

#include <algorithm>
#include <cmath>
#include <functional>

// Islands that sleep and wake [Parker & O'Brien 2009, section 4]: what makes a body fall asleep at the end of a step, and what
// wakes it in the course of one. Who sleeps with whom is islands/sleep.h's.
//
// A sleeper wakes, and its island with it, before the step is assembled: when a command gives it more than the threshold;
// when its own scripted nodes move; when a scripted body that it touches, or whose box it is in, moves; when contact with
// something live is found. A rigid sleeper that a rigid body runs into wakes in the rigid stage; soft bodies of its island
// are then stepped from the next step on.
namespace crumple::sim {
namespace {

using contact::Box3;
using islands::Activity;

constexpr int kLeastSteps = 5;         // of rest
constexpr double kRadiusPart = 0.2;    // of speed * time: how far a body at rest may stray
constexpr double kFragmentMean = 0.05;  // [s]: rigid fragments do not vibrate; what moves to and fro in them is contact
constexpr double kContactMean = 0.1;    // [s]: in contact, meshes settle into circles of a tenth of a millimetre, several steps long
constexpr double kContactSpeed = 2;     // times the speed, of meshes and fragments in contact: what leans on two corners swings for long
constexpr double kScriptRests = 1e-9;  // [m/s]: below it a script's velocity is rounding
constexpr double kNear = 0.01;         // of a box's diagonal: bodies that start asleep closer than this are one island

Box3 box_of(std::span<const Vec3> x) {
  Box3 box;
  for (const Vec3& p : x) box.extend(p);
  return box;
}

// Where a body is in the step, unless contact holds it.
Box3 way_of(const contact::CollisionBody& body, const Vec3& gravity, double dt) {
  Box3 box;
  for (std::size_t n = 0; n < body.x.size(); ++n) {
    const Vec3 v = body.rigid ? Vec3(body.rigid->v + body.rigid->w.cross(body.x[n] - body.rigid->p_WC)) : body.v[n];
    box.extend(body.x[n]);
    box.extend(Vec3(body.x[n] + dt * v));
    box.extend(Vec3(body.x[n] + dt * (v + dt * gravity)));
  }
  return box;
}

}  // namespace

// ---- who is where ----------------------------------------------------------------------------------------------

std::span<const Vec3> World::Impl::points(Part part) const {
  if (is_fragment(part)) return fragment(part).x();
  if (is_mesh(part)) return mesh(part).state.x;
  const Place place = places[part];
  return place.model == BodyModel::example_based ? examples[place.index].x : solids[place.index].x;
}

bool World::Impl::sleeps(BodyId id) const {
  bool live = is_live(body_part(id)), asleep = is_asleep(body_part(id));
  for (Part part = static_cast<Part>(places.size()); part < part_count() && !live; ++part) {
    if (soft[piece(part).soft].id != id) continue;
    live = is_live(part);
    asleep = asleep || is_asleep(part);
  }
  return asleep && !live;
}

Workload World::Impl::workload() const {
  Workload load;
  thread_local std::vector<Part> parts;  // of each body one that is live, or else one that sleeps, if there are any
  parts.resize(places.size());
  for (BodyId id = 0; id < places.size(); ++id) parts[id] = body_part(id);
  for (Part own = static_cast<Part>(places.size()); own < part_count(); ++own) {
    Part& part = parts[soft[piece(own).soft].id];
    if (is_live(own) || (is_asleep(own) && !is_live(part))) part = own;
    load.asleep_fragments += is_fragment(own) && is_asleep(own);
  }
  for (const Part part : parts) {
    load.live_bodies += is_live(part);
    load.asleep_bodies += is_asleep(part);
  }
  for (const SoftBody& body : soft) {
    const int tets = static_cast<int>(body.tets.size());
    if (is_live(body)) load.live_tets += tets, load.live_nodes += body.node_count();
    if (is_asleep(body)) load.asleep_tets += tets, load.asleep_nodes += body.node_count();
  }
  load.rigid_fragments = static_cast<int>(debris.size());
  return load;
}

void World::Impl::start_islands() {
  std::vector<Activity> activity(places.size(), Activity::live);
  for (BodyId id = 0; id < places.size(); ++id) {
    const Place place = places[id];
    const bool moves = place.model == BodyModel::fem ? !soft[place.index].is_kinematic() : rigid.is_moving(id);
    if (!moves) activity[id] = Activity::kinematic;
  }
  sleepers = islands::SleepingIslands(activity);
  stillness.resize(places.size());
  sleeping_box.resize(places.size());
  disturbed.assign(places.size(), 0);

  // Nothing is known of contacts yet: who starts asleep close to another is taken to lean on it.
  std::vector<BodyId> ids;
  std::vector<Box3> boxes;
  for (BodyId id = 0; id < places.size(); ++id) {
    const bool sleeps = scene.bodies[id].asleep && is_live(body_part(id));
    const bool scripted = activity[id] == Activity::kinematic && places[id].model != BodyModel::fixed;
    if (!sleeps && !scripted) continue;
    const Box3 box = box_of(points(body_part(id)));
    const Vec3 margin = Vec3::Constant(kNear * box.diagonal().norm());
    boxes.emplace_back(box.min() - margin, box.max() + margin);
    ids.push_back(id);
  }
  std::vector<char> by_soft(places.size(), 0);
  for (const auto& [a, b] : contact::sweep_and_prune(boxes)) {
    sleepers.touch(body_part(ids[a]), body_part(ids[b]));
    by_soft[ids[a]] |= places[ids[b]].model == BodyModel::fem;
    by_soft[ids[b]] |= places[ids[a]].model == BodyModel::fem;
  }
  for (const JointDescription& joint : scene.joints) {
    if (activity[joint.a] == Activity::live && activity[joint.b] == Activity::live) {
      sleepers.touch(static_cast<int>(joint.a), static_cast<int>(joint.b));
    }
  }
  sleepers.remember(0);
  for (const BodyId id : ids) {
    if (is_live(body_part(id))) lay_down(body_part(id), by_soft[id]);
  }
}

// ---- waking ------------------------------------------------------------------------------------------------------

void World::Impl::wake(Part part) { roused(sleepers.wake(part)); }

void World::Impl::roused(std::span<const int> woken) {
  for (const Part part : woken) {
    stillness[part] = {};
    if (!is_fragment(part) && !is_mesh(part)) rigid.wake(static_cast<BodyId>(part));
  }
}

void World::Impl::feel_commands() {
  const auto feel = [&](Part part, double push) {
    const bool felt = is_felt(push);
    if (felt) wake(part);
    disturbed[part] |= felt;
  };
  for (SoftBody& body : soft) {
    feel(part_of(body), body.strongest_push());
    if (!is_live(body)) body.forget_pushes();
  }
  for (const Part part : debris) {
    RigidFragment& pushed = fragment(part);
    feel(part, pushed.pushed().norm() / pushed.mass());
    if (!is_live(part)) pushed.forget_pushes();
  }
}

void World::Impl::feel_scripts() {
  for (SoftBody& body : soft) {
    const double speed = body.driven_speed();
    const Part part = part_of(body);
    if (speed > kScriptRests) {
      disturbed[part] = 1;
      wake(part);
      if (sleepers.activity(part) == Activity::kinematic) {
        feel_motion(part, way_of(collision_body(body), Vec3::Zero(), scene.dt));
      }
    } else if (speed > 0 && is_asleep(part)) {
      body.stop();
    }
  }
  for (const SolidBody& body : solids) {
    if (body.model.kind != RigidKind::kinematic || body.model.motion.empty()) continue;
    const Pose from = rigid.pose(body.id), to = pose_at(body.model.motion, time() + scene.dt);
    const double turn = angular_velocity_between(from.R_WB, to.R_WB, scene.dt).norm();
    Box3 box;
    double size = 0;
    for (const Vec3& X : body.proxy.X) {
      box.extend(from * X);
      box.extend(to * X);
      size = std::max(size, X.norm());
    }
    if ((to.p_WB - from.p_WB).norm() / scene.dt + turn * size <= kScriptRests) continue;
    disturbed[body.id] = 1;
    feel_motion(body_part(body.id), box);
  }
}

// A body moves through `box` of which the solve knows no unknowns, and contact with sleepers therefore nothing.
void World::Impl::feel_motion(Part mover, const Box3& box) {
  if (!sleepers.any_asleep()) return;
  roused(sleepers.wake_neighbours(mover));
  for (Part part = 0; part < part_count(); ++part) {
    if (is_asleep(part) && box.intersects(sleeping_box[part])) wake(part);
  }
}

// Leaves those sleepers out of detection that nothing live comes near.
void World::Impl::hide_far_sleepers() {
  if (!sleepers.any_asleep()) return;
  static const contact::CollisionMesh nothing;
  auto& [live, asleep, sleeper, pairs, near] = hiding;
  live.clear();
  asleep.clear();
  sleeper.clear();
  for (std::size_t b = 0; b < collision_bodies.size(); ++b) {
    const Part part = part_of(static_cast<int>(b));
    if (is_live(part)) live.push_back(way_of(collision_bodies[b], scene.gravity, scene.dt));
    if (!is_asleep(part) || sleeping_box[part].isEmpty()) continue;
    asleep.push_back(sleeping_box[part]);
    sleeper.push_back(b);
  }
  contact::sweep_and_prune(live, asleep, pairs);
  near.assign(sleeper.size(), 0);
  for (const auto& [a, b] : pairs) near[b] = 1;
  for (std::size_t k = 0; k < sleeper.size(); ++k) {
    if (near[k]) continue;
    contact::CollisionBody& body = collision_bodies[sleeper[k]];
    body.mesh = &nothing;
    body.x = body.v = {};
    body.fixed = {};
  }
}

// Rows of sleepers: two of them, or one and what is fixed, have none, so the other side is live.
bool World::Impl::wake_touched() {
  if (!sleepers.any_asleep()) return false;
  bool any = false;
  for (const contact::ContactRow& row : rows) {
    for (const contact::ContactSide& side : row.sides) {
      if (side.body >= static_cast<int>(collision_ids.size()) || !is_asleep(part_of(side.body))) continue;
      wake(part_of(side.body));
      any = true;
    }
  }
  return any;
}

void World::Impl::keep_friction_of_sleepers(const contact::FrictionMemory& before) {
  if (!sleepers.any_asleep()) return;
  const auto sleeps = [&](int body) { return body < static_cast<int>(collision_ids.size()) && is_asleep(part_of(body)); };
  for (const contact::FrictionMemory::Entry& entry : before.entries) {
    if (sleeps(entry.key[0]) || sleeps(entry.key[1])) friction.entries.push_back(entry);
  }
}

// ---- falling asleep ----------------------------------------------------------------------------------------------

void World::Impl::note_contacts() {
  const auto disturb = [&](Part part, Part mover) { disturbed[part] |= disturbed[mover] && !is_live(mover); };
  const auto is_fixed = [&](Part part) { return is_body(part) && places[part].model == BodyModel::fixed; };
  const auto touch = [&](Part a, Part b) {
    if (is_fixed(a) || is_fixed(b)) return;
    sleepers.touch(a, b);
    disturb(a, b);
    disturb(b, a);
  };
  touched.assign(part_count(), 0);
  for (const islands::CompositeIsland& island : composite) {
    // A chain through all of them says that they are one island as well as all their contacts do.
    int last = -1;
    for (const std::vector<int>* members : {&island.soft, &island.rigid})
      for (const int member : *members) {
        if (last >= 0) touch(part_of(last), part_of(member));
        last = member;
      }
    for (const contact::ContactRow& row : island.rows) {
      const int a = row.sides[0].body, b = row.sides[1].body;
      touched[part_of(a)] = 1;
      if (b >= static_cast<int>(collision_ids.size())) continue;
      touched[part_of(b)] = 1;
      if (!is_live(part_of(a)) || !is_live(part_of(b))) touch(part_of(a), part_of(b));
    }
  }
  for (const ContactImpulse& contact : rigid.contact_impulses()) touch(body_part(contact.a), body_part(contact.b));
  for (int k = 0; k < static_cast<int>(scene.joints.size()); ++k) {
    if (rigid.is_joined(k)) touch(body_part(scene.joints[k].a), body_part(scene.joints[k].b));
  }
}

// Looks at a live body or fragment at the end of a step. A rigid body is seen by four of its points.
bool World::Impl::rests(Part part) {
  const double mean = is_fragment(part) ? kFragmentMean : is_mesh(part) && touched[part] ? kContactMean : 0;
  const double speed = (mean > 0 && touched[part] ? kContactSpeed : 1) * scene.sleep.speed;
  const islands::StillnessBounds bounds{speed, kRadiusPart * speed * scene.sleep.time, mean};
  if (is_fragment(part) || is_mesh(part)) {
    islands::observe(points(part), scene.dt, bounds, stillness[part]);
  } else {
    const Place place = places[part];
    const BodyId id = static_cast<BodyId>(part);
    const bool example = place.model == BodyModel::example_based;
    double size = 0;
    for (const Vec3& X : example ? examples[place.index].proxy.X : solids[place.index].proxy.X) size = std::max(size, X.norm());
    const Pose X_WB = rigid.pose(id);
    const Vec3 seen[] = {X_WB.p_WB, X_WB * Vec3(size, 0, 0), X_WB * Vec3(0, size, 0), X_WB * Vec3(0, 0, size)};
    islands::observe(seen, scene.dt, bounds, stillness[part]);
    if (example && !examples[place.index].is_settled()) stillness[part].steps = 0;
  }
  if (disturbed[part]) stillness[part].steps = 0;
  return stillness[part].steps >= steps_of_rest();
}

int World::Impl::steps_of_rest() const {
  return static_cast<int>(std::clamp(std::ceil(scene.sleep.time / scene.dt - 1e-9), static_cast<double>(kLeastSteps), 1e9));
}

void World::Impl::lay_down(Part part, bool carried) {
  sleepers.put_to_sleep(part);
  stillness[part] = {};
  if (is_fragment(part)) {
    fragment(part).stop();
  } else if (is_mesh(part)) {
    SoftBody& body = mesh(part);
    body.stop();
    all_fixed.resize(std::max(all_fixed.size(), body.state.x.size()), 1);
  } else {
    const Place place = places[part];
    const BodyId id = static_cast<BodyId>(part);
    rigid.sleep(id, carried);
    if (place.model == BodyModel::example_based) examples[place.index].follow(rigid.pose(id));
    else solids[place.index].follow(rigid.pose(id));
  }
  sleeping_box[part] = box_of(points(part));
}

void World::Impl::settle(StepReport& report) {
  const auto is_held = [&](Part part) {
    if (is_fragment(part)) return fragment(part).is_held();
    return is_mesh(part) ? mesh(part).frozen : !rigid.is_moving(static_cast<BodyId>(part));
  };
  for (Part part = 0; part < part_count(); ++part) {  // frozen in this step
    if (sleepers.activity(part) != Activity::kinematic && is_held(part)) sleepers.set_kinematic(part);
  }
  report.workload = workload();
  if (scene.sleep.speed == 0 || report.workload.live_bodies == 0) return;
  note_contacts();
  still.assign(part_count(), 0);
  const auto look = [&](int begin, int end) {
    for (Part part = begin; part < end; ++part)
      if (is_live(part)) still[part] = rests(part);
  };
  pool.for_chunks(part_count(), 4, std::cref(look));
  const std::vector<int> fell = sleepers.settle(still, steps_of_rest());
  if (fell.empty()) return;
  std::vector<char> with_soft(part_count(), 0);
  for (const islands::CompositeIsland& island : composite) {
    for (const int b : island.rigid) with_soft[part_of(b)] = 1;
  }
  for (const Part part : fell) lay_down(part, with_soft[part]);
  // Whole islands fell asleep.
  std::erase_if(accounts, [&](const IslandAccount& account) { return !account.soft.empty() && is_asleep(soft[account.soft[0]]); });
  report.workload = workload();
}

}  // namespace crumple::sim
