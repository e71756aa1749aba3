#include "server/lab/impulse_tuning.h"

#include "server/sim/world.h"

#include <algorithm>
#include <map>

namespace crumple::lab {
namespace {

constexpr double kQuiet = 0.95;    // of the impulses do not dent
constexpr double kStrong = 0.999;  // of them are below the one that dents fully

struct Group {
  std::vector<std::string> bodies;
  double mass = 0;
  sim::example_based::ExampleParameters parameters;
  std::vector<double> impulses;  // [N s]
};

double mass_of(const sim::ExampleModel& model) {
  return model.mass > 0 ? model.mass : model.density * sim::example_based::rest_volume(*model.set);
}

Json report(Group& group, const sim::SceneDescription& scene) {
  std::vector<double>& j = group.impulses;
  std::ranges::sort(j);
  const auto at = [&](double q) { return j[static_cast<std::size_t>(q * static_cast<double>(j.size() - 1) + 0.5)]; };
  Json result{{"bodies", group.bodies}, {"mass", group.mass}, {"beta", group.parameters.beta}, {"alpha", group.parameters.alpha}};
  result["impulses"] = {{"count", j.size()}};
  result["suggested"] = {{"beta", nullptr}, {"alpha", nullptr}};
  if (j.empty()) return result;
  for (const auto& [name, q] : {std::pair("p50", 0.5), {"p90", 0.9}, {"p95", 0.95}, {"p99", 0.99}, {"p99.9", kStrong}, {"most", 1.0}}) {
    result["impulses"][name] = at(q);
  }
  const double beta = std::max(at(kQuiet), 2 * group.mass * scene.gravity.norm() * scene.dt);
  if (!(at(kStrong) > beta)) return result;
  result["suggested"] = {{"beta", beta}, {"alpha", group.mass / (scene.rate_dt * (at(kStrong) - beta))}};
  return result;
}

}  // namespace

Result<Json> suggest_parameters(const sim::SceneDescription& scene, const BenchmarkOptions& options) {
  std::vector<Group> groups;
  std::map<std::pair<const void*, double>, std::size_t> known;
  std::vector<std::size_t> group_of(scene.bodies.size(), 0);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* model = std::get_if<sim::ExampleModel>(&scene.bodies[b].model);
    if (!model || !model->set) continue;
    const auto [at, is_new] = known.emplace(std::pair(model->set.get(), model->mass > 0 ? model->mass : -model->density), groups.size());
    group_of[b] = at->second;
    if (is_new) groups.push_back({});
    groups[at->second].bodies.push_back(scene.bodies[b].name);
    groups[at->second].parameters = model->parameters;
  }
  if (groups.empty()) return invalid("scene", "has no example-based body");
  auto made = sim::World::create(scene, {.threads = options.threads, .strikes = true});
  if (!made) return std::unexpected(made.error());
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (const auto* model = std::get_if<sim::ExampleModel>(&scene.bodies[b].model); model && groups[group_of[b]].mass == 0)
      groups[group_of[b]].mass = mass_of(*model);

  for (int k = 0; k < options.steps; ++k) {
    (*made)->step();
    (*made)->take_events();
    for (const sim::Strike& strike : (*made)->strikes()) groups[group_of[strike.body]].impulses.push_back(strike.impulse);
  }
  Json result = Json::array();
  for (Group& group : groups) result.push_back(report(group, scene));
  return Json{{"steps", options.steps}, {"groups", result}};
}

}  // namespace crumple::lab
