#include "server/sim/world_impl.h"

#include <algorithm>

// What contacts, commands and scripts do in a step: for the guard, which asks where an island's energy comes from, and for
// whoever asks for the world's balance.
namespace crumple::sim {
namespace {

// Midpoint velocity of a rigid part over the solve, at a point `arm` from its centre.
Vec3 midpoint_velocity(const islands::RigidPart& before, const islands::RigidVelocity& after, const Vec3& arm) {
  return 0.5 * (before.v + after.v) + 0.5 * (before.w + after.w).cross(arm);
}

// What a side's unknowns contribute to the row's relative velocity, at the midpoint of the solve.
Vec3 midpoint_velocity(const contact::ContactRow& row, int which, const islands::CompositeIsland& island,
                       const islands::IslandSolution& solution, std::span<const islands::IslandBody> bodies) {
  const contact::ContactSide& side = row.sides[which];
  Vec3 v = Vec3::Zero();
  if (side.rigid) {
    const auto after = std::ranges::find(solution.rigid, side.body, &islands::RigidVelocity::body);
    if (after == solution.rigid.end()) return v;
    return (which == 0 ? 1 : -1) * midpoint_velocity(*bodies[after->body].rigid, *after, side.arm);
  }
  if (side.node_count == 0) return v;
  const auto k = static_cast<int>(std::ranges::lower_bound(island.soft, side.body) - island.soft.begin());
  const Eigen::Map<const Eigen::VectorXd> after = solution.soft_velocity(k);
  const Eigen::VectorXd& before = bodies[side.body].system->guess;
  for (int i = 0; i < side.node_count; ++i) {
    const int at = 3 * side.nodes[i];
    v += 0.5 * side.weights[i] * (before.segment<3>(at) + after.segment<3>(at));
  }
  return v;
}

}  // namespace

// What rigid bodies do on soft ones through contacts, and what the recovery of overlaps may do: n lambda_n target. The
// rest of a row takes energy or hands it from one soft body of the island to another.
double World::Impl::contact_work(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                                 std::span<const islands::IslandBody> bodies) const {
  double work = 0;
  const auto is_soft = [&](const contact::ContactSide& side) { return side.body < static_cast<int>(soft.size()); };
  for (const contact::ContactRow& row : island.rows) {
    if (!row.active || !std::ranges::any_of(row.sides, is_soft)) continue;
    const Vec3 impulse = row.impulse();
    work += row.lambda_n * std::max(0.0, row.target) - impulse.dot(row.known_velocity);
    for (int side = 0; side < 2; ++side) {
      if (!row.sides[side].rigid) continue;
      const auto after = std::ranges::find(solution.rigid, row.sides[side].body, &islands::RigidVelocity::body);
      if (after == solution.rigid.end()) continue;
      const Vec3 v = midpoint_velocity(*bodies[after->body].rigid, *after, row.sides[side].arm);
      work += (side == 0 ? -1 : 1) * impulse.dot(v);
    }
  }
  return work;
}

double World::Impl::work_on_unknowns(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                                     std::span<const islands::IslandBody> bodies) const {
  double sum = 0;
  for (const contact::ContactRow& row : island.rows) {
    if (!row.active) continue;
    sum += row.impulse().dot(midpoint_velocity(row, 0, island, solution, bodies) +
                             midpoint_velocity(row, 1, island, solution, bodies));
  }
  return sum;
}

void World::Impl::account_contact(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                                  std::span<const islands::IslandBody> bodies, IslandAccount& account) {
  account.work += contact_work(island, solution, bodies);
  if (keeps_invariants) work.contact += work_on_unknowns(island, solution, bodies);
}

World::Impl::RigidTotals World::Impl::rigid_totals() const {
  RigidTotals totals;
  for (BodyId id = 0; id < places.size(); ++id) {
    if (places[id].model == BodyModel::fem || !rigid.is_moving(id)) continue;
    totals.kinetic += rigid.kinetic_energy(id);
    totals.momentum += rigid.momentum(id);
  }
  return totals;
}

Invariants World::invariants() const {
  const Impl& w = *impl_;
  Invariants result{.energies = energies()};
  if (!w.keeps_invariants) return result;
  result.contact_work = w.work.contact;
  result.command_work = w.work.rigid_commands;
  for (const SoftBody& body : w.soft) {
    result.command_work += body.command_work();
    result.prescribed_work += body.prescribed_work_now(w.scene.gravity, w.scene.dt);
  }
  return result;
}

}  // namespace crumple::sim
