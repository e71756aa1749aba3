#include "common/text.h"
#include "server/sim/world_impl.h"

#include <algorithm>
#include <functional>

// The rigid step and the example-based bodies that live on its impulses.
namespace crumple::sim {

void World::Impl::step_rigid(StepReport& report) {
  strikes.clear();
  if (solids.empty() && examples.empty()) return;
  const RigidTotals before = keeps_invariants ? rigid_totals() : RigidTotals{};
  const RigidStepReport outcome = rigid.step(scene.dt, scene.rigid_substeps);
  if (keeps_invariants) {  // what gravity does not explain
    const RigidTotals after = rigid_totals();
    const double fall = scene.dt * scene.gravity.dot(0.5 * (before.momentum + after.momentum));
    work.contact += after.kinetic - before.kinetic - fall;
  }
  report.worst_penetration = std::max(report.worst_penetration, outcome.worst_penetration);
  report.rigid_sweeps = outcome.sweeps;
  report.rigid_residual = outcome.residual;
  for (BodyId id : outcome.frozen) {
    add_event(EventKind::frozen, id).message =
        text(scene.bodies[id].name, " left the range of finite numbers and is held where it last was");
  }
  for (BodyId id : outcome.woken) wake(id);  // and with it the rest of its island, soft bodies from the next step on
  break_joints(report);
  for (const ContactImpulse& contact : rigid.contact_impulses()) {
    const auto strike = [&](BodyId id, const Vec3& point_B, const Vec3& impulse_W) {
      if (places[id].model != BodyModel::example_based) return;
      if (keeps_strikes) strikes.push_back({id, impulse_W.norm()});
      examples[places[id].index].strike(point_B, rigid.pose(id).R_WB.conjugate() * impulse_W);
    };
    strike(contact.a, contact.point_a_B, contact.impulse_W);
    strike(contact.b, contact.point_b_B, -contact.impulse_W);
  }
}

// Joint k of the scene is joint k of the rigid room.
void World::Impl::make_joints() {
  for (const JointDescription& joint : scene.joints) rigid.join(joint.a, joint.b, joint.point);
  joint_loads.assign(scene.joints.size(), LoadWindow(scene.dt, scene.joint_time));
}

// By what part a joint is loaded beyond what it bears; up to 1 it holds.
static double load_of(const JointDescription& joint, const LoadWindow& load) {
  const double force = joint.strength > 0 ? load.force().norm() / joint.strength : 0;
  const double moment = joint.bending > 0 ? load.moment().norm() / joint.bending : 0;
  return std::max(force, moment);
}

// A storm of breaks is spread over steps: what stays joined is looked at again in the next.
void World::Impl::break_joints(StepReport& report) {
  std::vector<std::pair<double, int>> overloaded;
  for (int k = 0; k < static_cast<int>(scene.joints.size()); ++k) {
    const JointDescription& joint = scene.joints[k];
    if (!rigid.is_joined(k) || (!is_live(body_part(joint.a)) && !is_live(body_part(joint.b)))) continue;
    joint_loads[k].add(rigid.joint_load(k));
    const double load = load_of(joint, joint_loads[k]);
    if (load > 1) overloaded.emplace_back(load, k);
  }
  std::ranges::stable_sort(overloaded, std::greater<>(), &std::pair<double, int>::first);
  if (static_cast<int>(overloaded.size()) > scene.max_breaks_per_step) overloaded.resize(scene.max_breaks_per_step);
  for (const auto& [load, k] : overloaded) {
    const JointDescription& joint = scene.joints[k];
    Event& event = add_event(EventKind::parted, joint.a);
    event.point = rigid.joint_point(k);
    event.magnitude = joint_loads[k].force().norm();
    event.count = 1;
    event.message = text(scene.bodies[joint.a].name, " parts from ", scene.bodies[joint.b].name);
    rigid.part(k);
    wake(body_part(joint.a));
    wake(body_part(joint.b));
  }
  report.broken_joints = static_cast<int>(overloaded.size());
}

void World::Impl::deform_examples(StepReport& report) {
  pool.for_jobs(static_cast<int>(examples.size()), [&](int k) {
    if (!is_asleep(body_part(examples[k].id))) examples[k].deform(scene.dt, scene.rate_dt, pool);
  });
  example_times = {};
  for (ExampleBody& body : examples) {
    if (is_asleep(body_part(body.id))) continue;
    if (now_ms) example_times += body.times();
    const double deformed = now_ms ? now_ms() : 0;
    const DentOutcome outcome = body.settle(rigid);
    if (now_ms) example_times.shape += now_ms() - deformed;
    if (!outcome.finite) {
      add_event(EventKind::frozen, body.id).message =
          text(scene.bodies[body.id].name, " has a shape that is not finite: it keeps its last one and does not deform any more");
    }
    if (outcome.plastic == 0) continue;
    report.plastic_impulses += outcome.plastic;
    Event& event = add_event(EventKind::dent, body.id);
    event.point = outcome.point;
    event.magnitude = outcome.strongest;
    event.count = outcome.plastic;
    event.message = text(scene.bodies[body.id].name, " takes a dent of ", outcome.strongest, " N s");
  }
}

}  // namespace crumple::sim
