#include "common/text.h"
#include "server/sim/fem/float_matrix.h"
#include "server/sim/islands/island_system.h"
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
      if (!kept) return kept;
      auto object = FemObject::make(body, *fem, places[id].index, soft.back());
      if (!object) return std::unexpected(Error{object.error().code, field + ".fem." + object.error().field, object.error().message});
      objects.push_back(*std::move(object));
      soft_parts.push_back(body_part(id));
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
      case BodyModel::fem:
        objects[index].draw(soft);
        topology.bodies[id] = objects[index].topology(soft);
        break;
      case BodyModel::example_based: topology.bodies[id] = examples[index].topology(body); break;
      default: topology.bodies[id] = solids[index].topology(body, reach);
    }
  }
  prepare();
  if (scene.float_solver.value_or(false)) warn_of_floats();
  return {};
}

void World::Impl::warn_of_floats() {
  for (const SoftBody& body : soft) {
    if (body.is_kinematic()) continue;
    const double stiffness = fem::stiffness_over_mass(body.rest, scene.dt);
    if (stiffness <= fem::kFloatStiffness) continue;
    Event& event = add_event(EventKind::warning, body.id);
    event.magnitude = stiffness;
    event.message = text("float_solver: ", scene.bodies[body.id].name, " is ", stiffness, " times as stiff in a step as heavy; above ",
                         fem::kFloatStiffness, " solves in float may miss their tolerance");
  }
}

// Patterns and coarse levels, which a large body's first step would take longer for, and the memory of a solve. Each body is assembled
// where it starts, sleepers too, and solved by itself without an iteration. Factors where they are asked for, or likely to be used for long.
// A direct solve keeps nothing from step to step.
void World::Impl::prepare() {
  if (scene.solver == linear_solver::SolverKind::direct) return;
  const auto assemble_one = [&](int b) {
    if (!soft[b].is_kinematic()) soft[b].prepare(scene.gravity, scene.dt, pool);
  };
  pool.for_jobs(static_cast<int>(soft.size()), std::cref(assemble_one));
  std::vector<islands::CompositeIsland> alone;
  std::vector<islands::IslandOptions> options;
  island_bodies.resize(soft.size());
  for (int b = 0; b < static_cast<int>(soft.size()); ++b) {
    if (soft[b].is_empty() || soft[b].is_kinematic()) continue;
    set_unknowns(soft[b], island_bodies[b]);
    island_bodies[b].factor = nullptr;
    alone.push_back({.soft = {b}});
    options.push_back(solve_options(alone.back()));
    options.back().solve.max_iterations = 0;
  }
  const auto make_factors = [&](int k) {
    SoftBody& body = soft[alone[k].soft[0]];
    islands::IslandBody unknowns;
    set_unknowns(body, unknowns);
    const bool asked = scene.solver == linear_solver::SolverKind::warped_factor && unknowns.factor;
    if (asked || (scene.solver == linear_solver::SolverKind::automatic && islands::is_worth_a_factor(unknowns)))
      body.make_factors(scene.dt, pool);
  };
  pool.for_jobs(static_cast<int>(alone.size()), std::cref(make_factors));
  islands::solve_all(alone, island_bodies, options, {}, pool, solve_memories, solutions);
}

}  // namespace crumple::sim
