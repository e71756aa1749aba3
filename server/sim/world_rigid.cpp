#include "common/text.h"
#include "server/sim/world_impl.h"

#include <algorithm>

// The rigid step and the example-based bodies that live on its impulses.
namespace crumple::sim {

void World::Impl::step_rigid(StepReport& report) {
  if (solids.empty() && examples.empty()) return;
  const RigidTotals before = keeps_invariants ? rigid_totals() : RigidTotals{};
  const RigidStepReport outcome = rigid.step(scene.dt, scene.rigid_substeps);
  if (keeps_invariants) {  // what gravity does not explain
    const RigidTotals after = rigid_totals();
    const double fall = scene.dt * scene.gravity.dot(0.5 * (before.momentum + after.momentum));
    work.contact += after.kinetic - before.kinetic - fall;
  }
  report.worst_penetration = std::max(report.worst_penetration, outcome.worst_penetration);
  for (BodyId id : outcome.frozen) {
    add_event(EventKind::frozen, id).message =
        text(scene.bodies[id].name, " left the range of finite numbers and is held where it last was");
  }
  for (BodyId id : outcome.woken) wake(id);  // and with it the rest of its island, soft bodies from the next step on
  for (const ContactImpulse& contact : rigid.contact_impulses()) {
    const auto strike = [&](BodyId id, const Vec3& point_B, const Vec3& impulse_W) {
      if (places[id].model != BodyModel::example_based) return;
      examples[places[id].index].strike(point_B, rigid.pose(id).R_WB.conjugate() * impulse_W);
    };
    strike(contact.a, contact.point_a_B, contact.impulse_W);
    strike(contact.b, contact.point_b_B, -contact.impulse_W);
  }
}

void World::Impl::add_times(const ExampleTimes& body) {
  example_times.locate += body.locate;
  example_times.projection += body.deform.projection;
  example_times.propagation += body.deform.propagation;
  example_times.weights += body.deform.weights;
  example_times.skinning += body.deform.skinning;
  example_times.shape += body.shape;
}

void World::Impl::deform_examples(StepReport& report) {
  pool.for_chunks(static_cast<int>(examples.size()), 1, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      if (!is_asleep(examples[k].id)) examples[k].deform(scene.dt, scene.rate_dt, pool);
  });
  example_times = {};
  for (ExampleBody& body : examples) {
    if (is_asleep(body.id)) continue;
    if (now_ms) add_times(body.times());
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
