#include "common/text.h"
#include "server/sim/fem/float_matrix.h"
#include "server/sim/world_impl.h"

#include <algorithm>
#include <functional>

namespace crumple::sim {
namespace {

// Planes have no end; drawn they are half as large again as what they carry, within reason [m].
double plane_reach(const SceneDescription& scene) {
  double farthest = 0;
  for (const BodyDescription& body : scene.bodies) farthest = std::max(farthest, body.pose.p_WB.norm());
  return std::clamp(1.5 * farthest, 10.0, 200.0);
}

}  // namespace

Result<void> World::Impl::make_bodies() {
  places.resize(scene.bodies.size());
  SoftBodyOptions options{scene.dt, scene.integrator, scene.float_solver, !scene.unguarded};
  if (scene.solver == linear_solver::SolverKind::direct && !options.float_solver) options.float_solver = false;  // a reference
  SharedRests rests;
  for (BodyId id = 0; id < scene.bodies.size(); ++id) {
    const BodyDescription& body = scene.bodies[id];
    const std::string field = text("bodies[", id, "]");
    const auto keep = [&](auto made, auto& list, BodyModel model) -> Result<void> {
      if (!made) return std::unexpected(made.error());
      places[id] = {model, static_cast<int>(list.size())};
      list.push_back(std::move(*made));
      return {};
    };
    Result<void> kept;
    if (const auto* fem = std::get_if<FemModel>(&body.model)) {
      kept = keep(SoftBody::make(id, body, *fem, options, field + ".fem"), soft, BodyModel::fem);
    } else if (const auto* example = std::get_if<ExampleModel>(&body.model)) {
      kept = keep(ExampleBody::make(id, body, *example, rigid, field + ".example", rests), examples, BodyModel::example_based);
    } else {
      const auto& model = std::get<RigidModel>(body.model);
      kept = keep(SolidBody::make(id, body, model, rigid, field + ".rigid"), solids,
                  model.kind == RigidKind::fixed ? BodyModel::fixed : BodyModel::rigid);
    }
    if (!kept) return kept;
  }
  was_capped.assign(soft.size(), 0);
  guards.resize(soft.size());
  for (ExampleBody& body : examples) body.meets_only_rigid = soft.empty();
  make_joints();
  start_islands();
  topology.bodies.resize(places.size());
  const double reach = plane_reach(scene);
  for (BodyId id = 0; id < places.size(); ++id) {
    const BodyDescription& body = scene.bodies[id];
    const auto [model, index] = places[id];
    switch (model) {
      case BodyModel::fem: topology.bodies[id] = soft[index].topology(); break;
      case BodyModel::example_based: topology.bodies[id] = examples[index].topology(body); break;
      default: topology.bodies[id] = solids[index].topology(body, reach);
    }
  }
  prepare();
  for (const SoftBody& body : soft) {
    if (body.float_alarm == 0) continue;
    Event& event = add_event(EventKind::solver, body.id);
    event.magnitude = body.float_alarm;
    event.message = text("float_solver: ", scene.bodies[body.id].name, " is ", body.float_alarm, " times as stiff in a step as heavy; above ",
                         fem::kFloatStiffness, " solves in float may miss their tolerance");
  }
  return {};
}

// What else the first step would make besides its own work: patterns, coarse levels, factors, memory. It is found by a solve of the scene as
// it starts, of which nothing is taken: a large body's first step takes no longer than others.
void World::Impl::prepare() {
  if (soft.empty() || scene.solver == linear_solver::SolverKind::direct) return;
  place_for_contact();
  contact::detect({collision_bodies, planes, scene.gravity, scene.dt, scene.contact}, pool, detection, rows);
  const auto prepare_one = [&](int b) {
    if (is_live(body_part(soft[b].id))) soft[b].prepare(scene.gravity, scene.dt, pool);
  };
  pool.for_jobs(static_cast<int>(soft.size()), std::cref(prepare_one));
  fill_island_bodies();
  islands::composite_islands(island_bodies, rows, composite);
  rows.clear();
  island_options.clear();
  for (const islands::CompositeIsland& island : composite) island_options.push_back(solve_options(island));
  islands::solve_all(composite, island_bodies, island_options, friction_before, pool, solve_memories, solutions);
}

}  // namespace crumple::sim
