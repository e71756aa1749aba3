#include "server/lab/benchmark.h"

#include "server/lab/clock.h"
#include "server/lab/vertex_depth.h"
#include "server/sim/world.h"

#include <sys/resource.h>

#include <algorithm>
#include <iomanip>
#include <map>
#include <numeric>
#include <sstream>

namespace crumple::lab {
namespace {

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Json quantiles(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double q) { return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1) + 0.5)]; };
  return {{"mean", std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size())},
          {"median", at(0.5)}, {"p99", at(0.99)}, {"worst", ms.back()}};
}

double mean_of_last(const std::vector<double>& ms, std::size_t count) {
  const auto begin = ms.end() - static_cast<std::ptrdiff_t>(std::min(count, ms.size()));
  return std::accumulate(begin, ms.end(), 0.0) / static_cast<double>(ms.end() - begin);
}

Json sleep_of(const sim::Workload& load, int all_asleep_at) {
  Json result{{"live_bodies", load.live_bodies}, {"asleep_bodies", load.asleep_bodies}, {"live_tets", load.live_tets},
              {"asleep_tets", load.asleep_tets}, {"live_nodes", load.live_nodes}, {"asleep_nodes", load.asleep_nodes},
              {"asleep_fragments", load.asleep_fragments}};
  if (load.live_bodies == 0) result["all_asleep_at"] = all_asleep_at;
  return result;
}

Json depth_of(const std::vector<double>& mm) {
  int longest = 0, run = 0;
  for (const double depth : mm) longest = std::max(longest, run = depth > 20 ? run + 1 : 0);
  return {{"worst", std::ranges::max(mm)}, {"end", mm.back()}, {"steps_over_20", longest}};
}

bool may_sleep(const sim::SceneDescription& scene) {
  return scene.sleep.speed > 0 || std::ranges::any_of(scene.bodies, &sim::BodyDescription::asleep);
}

std::string hexadecimal(std::uint64_t value) {
  std::ostringstream out;
  out << std::hex << std::setw(16) << std::setfill('0') << value;
  return out.str();
}

// Mean displacement of the nodes that are on the x = max face at rest.
Vec3 tip_displacement(const sim::World& world, const sim::SceneDescription& scene, BodyId body) {
  const std::vector<Vec3>& X = std::get<sim::FemModel>(scene.bodies[body].model).mesh->X;
  double end = X.front().x();
  for (const Vec3& p : X) end = std::max(end, p.x());
  Vec3 sum = Vec3::Zero();
  int count = 0;
  const sim::FemView view = world.fem(body);
  for (std::size_t n = 0; n < X.size(); ++n) {
    if (X[n].x() < end - 1e-9) continue;
    sum += view.x[n] - scene.bodies[body].pose * X[n];
    ++count;
  }
  return sum / count;
}

void append(const sim::Invariants& now, Json& lists) {
  const auto row = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  lists["momentum"].push_back(row(now.energies.momentum));
  lists["angular_momentum"].push_back(row(now.energies.angular_momentum));
  lists["kinetic"].push_back(now.energies.kinetic);
  lists["elastic"].push_back(now.energies.elastic);
  lists["gravitational"].push_back(now.energies.gravitational);
  lists["contact_work"].push_back(now.contact_work);
  lists["command_work"].push_back(now.command_work);
  lists["prescribed_work"].push_back(now.prescribed_work);
}

// Adds a step's times to their means over `steps`.
void add_means(const sim::example_based::ExampleTimes& t, int steps, std::map<std::string, double>& means) {
  for (const auto& [part, ms] : {std::pair("locate", t.locate), {"projection", t.projection}, {"propagation", t.propagation},
                                 {"weights", t.weights}, {"skinning", t.skinning}, {"shape", t.shape}}) {
    means[part] += ms / steps;
  }
}

}  // namespace

Json assets_of(const sim::SceneDescription& scene) {
  std::map<const sim::example_based::ExampleSet*, std::size_t> place;
  Json list = Json::array();
  for (const sim::BodyDescription& body : scene.bodies) {
    const auto* model = std::get_if<sim::ExampleModel>(&body.model);
    if (!model) continue;
    const auto [at, is_new] = place.emplace(model->set.get(), list.size());
    const sim::example_based::ExampleSet& set = *model->set;
    if (is_new) {
      list.push_back({{"first", body.name}, {"bodies", 0}, {"vertices", set.vertex_count()}, {"tets", set.mesh.tet_count()},
                      {"surface_triangles", sim::surface_faces(set.mesh.tets).size()}, {"bones", set.bone_count()},
                      {"examples", set.example_count()}, {"convex_parts", set.convex_parts.size()}});
    }
    list[at->second]["bodies"] = list[at->second]["bodies"].get<int>() + 1;
  }
  return list;
}

Result<Json> run_benchmark(const sim::SceneDescription& scene, const BenchmarkOptions& options,
                           const std::function<void(int)>& on_step) {
  auto made = sim::World::create(scene, {.threads = options.threads, .invariants = options.invariants, .rigid_tolerance = options.rigid_tolerance});
  if (!made) return std::unexpected(made.error());
  sim::World& world = **made;
  world.set_clock(now_ms);

  std::vector<BodyId> soft;
  for (BodyId b = 0; b < scene.bodies.size(); ++b) {
    if (std::holds_alternative<sim::FemModel>(scene.bodies[b].model)) soft.push_back(b);
  }
  std::vector<double> step_ms;
  std::map<std::string, std::vector<double>> every_ms;  // of the stages that are reported by quantiles
  std::map<std::string, double> parts_ms;
  int plastic = 0, broken_joints = 0, most_broken = 0;
  std::vector<std::string> stage_order;
  std::map<std::string, double> stage_ms;
  double iterations = 0, residual = 0, penetration = 0, sweeps = 0;
  std::vector<double> rigid_residuals;
  int capped = 0, inverted = 0, splits = 0, contacts = 0, all_asleep_at = 1;
  Json invariants;
  std::vector<double> depth_mm;
  for (int k = 0; k < options.steps; ++k) {
    const double start = now_ms();
    const sim::StepReport report = world.step();
    step_ms.push_back(now_ms() - start);
    for (const sim::StageTime& stage : world.stage_times()) {
      if (!stage_ms.contains(stage.name)) stage_order.push_back(stage.name);
      stage_ms[stage.name] += stage.ms / options.steps;
      if (stage.name == std::string_view("rigid") || stage.name == std::string_view("examples"))
        every_ms[stage.name].push_back(stage.ms);
    }
    add_means(world.example_times(), options.steps, parts_ms);
    plastic += report.plastic_impulses;
    broken_joints += report.broken_joints;
    most_broken = std::max(most_broken, report.broken_joints);
    iterations += report.solver_iterations;
    residual = std::max(residual, report.worst_residual);
    capped += report.capped_solves > 0;
    penetration = std::max(penetration, report.worst_penetration);
    splits += report.splits;
    contacts = std::max(contacts, report.contacts);
    sweeps += report.rigid_sweeps;
    rigid_residuals.push_back(report.rigid_residual);
    if (report.workload.live_bodies > 0) all_asleep_at = k + 2;
    // No more than has to be looked at: a whole view would leave the next step a cold cache.
    inverted = std::max(inverted, std::accumulate(soft.begin(), soft.end(), 0, [&](int sum, BodyId b) { return sum + world.inverted(b); }));
    if (options.invariants) append(world.invariants(), invariants);
    if (options.depth) depth_mm.push_back(1000 * vertex_depth(world, scene));
    world.take_events();
    on_step(k + 1);
  }

  Json result{{"ms_per_step", quantiles(step_ms)}, {"state_hash", hexadecimal(world.state_hash())}, {"peak_rss_mb", peak_rss_mb()}};
  result["ms_per_step"]["end"] = mean_of_last(step_ms, 10);
  if (may_sleep(scene)) result["sleep"] = sleep_of(world.workload(), all_asleep_at);
  for (const std::string& stage : stage_order) result["stages"][stage] = stage_ms[stage];
  if (!soft.empty()) {
    result["solver"] = {{"iterations_mean", iterations / options.steps}, {"residual_worst", residual}, {"capped_steps", capped}};
    result["inverted"] = inverted;
    result["fragments"] = std::accumulate(soft.begin(), soft.end(), 0, [&](int sum, BodyId b) { return sum + world.fem(b).fragments; });
    result["splits"] = splits;
    result["contacts_most"] = contacts;
  }
  if (Json assets = assets_of(scene); !assets.empty()) {
    Json& examples = result["examples"];
    examples["assets"] = std::move(assets);
    examples["rigid_ms"] = quantiles(every_ms["rigid"]);
    examples["deform_ms"] = quantiles(every_ms["examples"]);
    examples["parts_ms"] = parts_ms;
    examples["plastic_impulses"] = plastic;
  }
  if (sweeps > 0) {
    std::ranges::sort(rigid_residuals);
    result["rigid"] = {{"sweeps_mean", sweeps / options.steps}, {"residual_median", rigid_residuals[rigid_residuals.size() / 2]},
                       {"residual_worst", rigid_residuals.back()}};
  }
  if (!scene.joints.empty()) {
    result["joints"] = {{"count", scene.joints.size()}, {"broken", broken_joints}, {"most_in_a_step", most_broken}};
  }
  if (scene.bodies.size() > 1) result["penetration_mm_worst"] = 1000 * penetration;
  if (options.depth && options.steps > 0) result["vertex_depth_mm"] = depth_of(depth_mm);
  if (!options.tip.empty()) {
    const Vec3 tip = tip_displacement(world, scene, world.find(options.tip));
    result["tip"] = {tip.x(), tip.y(), tip.z()};
  }
  if (options.invariants) result["invariants"] = std::move(invariants);
  return result;
}

}  // namespace crumple::lab
