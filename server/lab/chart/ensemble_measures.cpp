#include "common/text.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"
#include "server/lab/chart/stage_split.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

namespace crumple::lab::chart {
namespace {

constexpr double kNudge = 1e-3;  // [m]: far below anything that a scene means

Vec3 nudge(std::mt19937_64& random) {
  const auto uniform = [&] { return kNudge * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1); };
  return {uniform(), 0, uniform()};
}

void apply(const Setup& setup, sim::SceneDescription& scene) {
  scene.dt = setup.dt;
  scene.float_solver = setup.float_solver;
  scene.solver = setup.solver;
  scene.unguarded = !setup.guarded;
  scene.seed = static_cast<std::uint64_t>(setup.seed);
  for (sim::BodyDescription& body : scene.bodies) {
    if (auto* fem = std::get_if<sim::FemModel>(&body.model)) {
      fem->material.cg_tolerance = setup.cg_tolerance;
      fem->material.cg_max_iterations = setup.cg_cap;
      fem->material.rotation = setup.rotation;
    }
  }
}

// Part of a body's volume that its largest face-connected piece has.
double largest_piece(const sim::TetMesh& rest, const std::vector<Tet>& tets) {
  std::vector<int> root(tets.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int k) {
    while (root[k] != k) k = root[k] = root[root[k]];
    return k;
  };
  std::map<std::array<int, 3>, int> faces;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int skip = 0; skip < 4; ++skip) {
      std::array<int, 3> face{};
      for (int a = 0, k = 0; a < 4; ++a) {
        if (a != skip) face[k++] = tets[t][a];
      }
      std::sort(face.begin(), face.end());
      const auto [at, added] = faces.try_emplace(face, static_cast<int>(t));
      if (!added) root[find(static_cast<int>(t))] = find(at->second);
    }
  }
  std::map<int, double> volume;
  double all = 0, largest = 0;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const double v = sim::signed_volume(rest, static_cast<int>(t));
    all += v;
    largest = std::max(largest, volume[find(static_cast<int>(t))] += v);
  }
  return largest / all;
}

// Fastest node of the soft bodies [m/s].
double peak_speed(const sim::World& world, int soft) {
  double peak = 0;
  for (int b = 0; b < soft; ++b) {
    for (const Vec3& v : world.fem(static_cast<BodyId>(b)).v) peak = std::max(peak, v.norm());
  }
  return peak;
}

double mean_speed(const sim::World& world, int soft) {
  double sum = 0;
  for (int b = 0; b < soft; ++b) sum += world.velocity(static_cast<BodyId>(b)).norm();
  return sum / soft;
}

sim::SceneDescription pile(const Setup& setup) {
  sim::SceneDescription scene = pile_scene();
  std::mt19937_64 random(static_cast<std::uint64_t>(setup.seed));
  for (sim::BodyDescription& body : scene.bodies) {
    if (std::holds_alternative<sim::FemModel>(body.model)) body.pose.p_WB += nudge(random);
  }
  apply(setup, scene);
  return scene;
}

sim::SceneDescription panel(const Setup& setup) {
  sim::SceneDescription scene = panel_scene();
  std::mt19937_64 random(static_cast<std::uint64_t>(setup.seed));
  Vec3 by = nudge(random);
  std::swap(by.y(), by.z());  // across the panel
  scene.bodies[1].pose.p_WB += by;
  apply(setup, scene);
  return scene;
}

void finish(double wall, double time, double iterations, double ms_worst, double penetration, const sim::World& world, int capped,
            Sample& sample) {
  sample.values["seconds"] = wall / time;
  sample.values["iterations"] = iterations / static_cast<double>(world.step_count());
  sample.values["ms_per_step"] = 1000 * wall / static_cast<double>(world.step_count());
  sample.values["ms_worst"] = ms_worst;
  sample.values["penetration_mm"] = 1000 * penetration;
  sample.values["capped_steps"] = capped;
  int inverted = 0;
  bool finite = true;
  for (int b = 0; b < world.body_count(); ++b) finite &= world.velocity(static_cast<BodyId>(b)).allFinite();
  inverted = world.fem(0).inverted;
  sample.values["inverted"] = inverted;
  if (!finite) sample.failure = "not finite";
}

// The same for all seeds: of the scene before its nudge.
template <class Make>
std::function<Result<std::uint64_t>(const Setup&, Workshop&)> hash_of(Make make) {
  return [make](const Setup& setup, Workshop&) -> Result<std::uint64_t> { return scene_hash(make(setup)); };
}

}  // namespace

Measure pile_ensemble() {
  constexpr int kSoft = 64;
  constexpr double kSettled = 0.1;  // mean speed of the cubes [m/s]
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto made = sim::World::create(pile(setup), {.threads = setup.threads});
            if (!made) return std::unexpected(made.error());
            sim::World& world = **made;
            const double end = workshop.quick ? 0.5 : 4;
            Sample sample;
            StageSplit split(world);
            double wall = 0, iterations = 0, worst = 0, penetration = 0, peak = 0, settled = 0;
            int capped = 0;
            while (world.time() < end - 1e-9) {
              const double from = now_seconds();
              const sim::StepReport report = world.step();
              const double took = now_seconds() - from;
              split.add();
              wall += took;
              worst = std::max(worst, 1000 * took);
              iterations += report.solver_iterations;
              penetration = std::max(penetration, report.worst_penetration);
              capped += report.capped_solves > 0;
              world.take_events();
              peak = std::max(peak, peak_speed(world, kSoft));
              if (mean_speed(world, kSoft) > kSettled) settled = world.time();
            }
            double height = 0;
            for (int b = 0; b < kSoft; ++b) height += world.pose(static_cast<BodyId>(b)).p_WB.y() / kSoft;
            finish(wall, world.time(), iterations, worst, penetration, world, capped, sample);
            split.report(sample);
            sample.values["peak_speed"] = peak;
            sample.values["settle_time"] = settled;
            sample.values["mean_height"] = height;
            return sample;
          },
          hash_of(pile)};
}

Measure panel_ensemble() {
  constexpr BodyId kPanel = 0, kBox = 1;
  constexpr double kBoxMass = 20;  // [kg]
  constexpr int kStorm = 10'000;   // contacts of pieces that lie in each other; a step of them takes seconds
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            const sim::SceneDescription scene = panel(setup);
            auto made = sim::World::create(scene, {.threads = setup.threads});
            if (!made) return std::unexpected(made.error());
            sim::World& world = **made;
            const double end = workshop.quick ? 0.2 : 1;
            Sample sample;
            StageSplit split(world);
            double wall = 0, iterations = 0, worst = 0, penetration = 0, impulse = 0, last_break = 0;
            int capped = 0;
            Vec3 before = world.velocity(kBox);
            while (world.time() < end - 1e-9) {
              const double from = now_seconds();
              const sim::StepReport report = world.step();
              const double took = now_seconds() - from;
              split.add();
              wall += took;
              worst = std::max(worst, 1000 * took);
              iterations += report.solver_iterations;
              penetration = std::max(penetration, report.worst_penetration);
              capped += report.capped_solves > 0;
              world.take_events();
              if (report.splits > 0) last_break = world.time();
              const Vec3 after = world.velocity(kBox);
              impulse = std::max(impulse, kBoxMass * (after - before - scene.dt * scene.gravity).norm());
              before = after;
              if (report.contacts > kStorm) {
                sample.failure = text("pieces lie in each other at ", world.time(), " s: ", report.contacts, " contacts");
                break;
              }
            }
            const sim::FemView view = world.fem(kPanel);
            finish(wall, world.time(), iterations, worst, penetration, world, capped, sample);
            split.report(sample);
            sample.values["fragments"] = view.fragments;
            sample.values["largest_piece"] = largest_piece(*std::get<sim::FemModel>(scene.bodies[kPanel].model).mesh, view.tets);
            sample.values["peak_impulse"] = impulse;
            sample.values["box_speed_left"] = before.norm();
            sample.values["settle_time"] = last_break;
            return sample;
          },
          hash_of(panel)};
}

}  // namespace crumple::lab::chart
