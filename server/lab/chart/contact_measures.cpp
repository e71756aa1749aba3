#include "common/text.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"
#include "server/lab/chart/stage_split.h"
#include "server/sim/world.h"

#include <cmath>
#include <numbers>

namespace crumple::lab::chart {
namespace {

constexpr double kGravity = 9.81;  // [m/s^2]
constexpr double kDegree = std::numbers::pi / 180;

// A block on the plane y = 0, gravity turned by `slope` about z towards +x: a slope without turning the scene.
sim::SceneDescription block_scene(const Setup& setup, double edge, double slope, double friction, double overlap) {
  sim::SceneDescription scene{.name = "block", .gravity = {kGravity * std::sin(slope), -kGravity * std::cos(slope), 0}, .dt = setup.dt};
  scene.contact.phi = setup.phi;
  scene.contact.kappa = setup.kappa;
  scene.contact.recovery_steps = setup.recovery_steps;
  scene.float_solver = setup.float_solver;
  scene.solver = setup.solver;
  scene.sleep.speed = 0;  // creep is measured
  sim::FemModel fem;
  fem.mesh = std::make_shared<sim::TetMesh>(*authoring::centred_box_mesh(Vec3::Constant(edge), {2, 2, 2}, setup.lattice));
  fem.material = {.young = 1e7, .poisson = 0.3, .density = 1000, .damping_stiffness = 0.01, .friction = friction,
                  .cg_tolerance = 1e-8, .cg_max_iterations = 3000};
  sim::BodyDescription block{.name = "block"};
  block.pose.p_WB = {0, 0.5 * edge - overlap, 0};
  block.model = fem;
  scene.bodies.push_back(block);
  sim::BodyDescription ground{.name = "ground"};
  sim::RigidModel plane{.kind = sim::RigidKind::fixed};
  plane.shapes.push_back({Pose{}, sim::Plane{}});
  plane.friction = friction;
  ground.model = plane;
  scene.bodies.push_back(ground);
  return scene;
}

// Height of the lowest node, and where the mean of all is.
struct Stand {
  double lowest;
  Vec3 mean;
};

Stand stand(const sim::World& world) {
  Stand s{1e9, Vec3::Zero()};
  const sim::FemView view = world.fem(0);
  for (const Vec3& x : view.x) {
    s.lowest = std::min(s.lowest, x.y());
    s.mean += x / static_cast<double>(view.x.size());
  }
  return s;
}

struct Watched {
  std::vector<Stand> stands;  // at the start and after each of the given times
  Sample sample;
};

Result<Watched> watch(const sim::SceneDescription& scene, const Setup& setup, const std::vector<double>& times) {
  auto made = sim::World::create(scene, {.threads = setup.threads});
  if (!made) return std::unexpected(made.error());
  sim::World& world = **made;
  Watched w;
  w.stands.push_back(stand(world));
  StageSplit split(world);
  double wall = 0, iterations = 0;
  for (double time : times) {
    while (world.time() < time - 1e-9) {
      const double from = now_seconds();
      iterations += world.step().solver_iterations;
      wall += now_seconds() - from;
      split.add();
    }
    w.stands.push_back(stand(world));
  }
  w.sample.values = {{"seconds", wall / times.back()}, {"iterations", iterations / static_cast<double>(world.step_count())}};
  split.report(w.sample);
  if (!w.stands.back().mean.allFinite()) w.sample.failure = "not finite";
  return w;
}

Measure block_measure(std::function<sim::SceneDescription(const Setup&)> scene, std::vector<double> times,
                      std::function<double(const Setup&, const std::vector<Stand>&)> error) {
  return {[=](const Setup& setup, Workshop&) -> Result<Sample> {
            auto w = watch(scene(setup), setup, times);
            if (!w) return std::unexpected(w.error());
            w->sample.values["error"] = error(setup, w->stands);
            return w->sample;
          },
          [=](const Setup& setup, Workshop&) -> Result<std::uint64_t> { return scene_hash(scene(setup)); }};
}

}  // namespace

Measure sinking_block() {
  constexpr double kMass = 1000, kArea = 1;  // edge 1 m
  return block_measure(
      [](const Setup& setup) {
        auto scene = block_scene(setup, 1, 0, 0.4, 0.01);
        scene.contact.raw_damping = true;
        return scene;
      },
      {1, 2},
      [](const Setup& setup, const std::vector<Stand>& s) {
        const double speed = s[1].mean.y() - s[2].mean.y(), formula = kMass * kGravity / (setup.phi * kArea);
        return std::abs(speed - formula) / formula;
      });
}

Measure resting_block() {
  return block_measure([](const Setup& setup) { return block_scene(setup, 1, 0, 0.4, 0); }, {2},
                       [](const Setup&, const std::vector<Stand>& s) { return std::max(0.0, -s.back().lowest); });
}

Measure sliding_block(double friction) {
  constexpr double kFrom = 1, kTo = 2;  // [s]
  return block_measure([=](const Setup& setup) { return block_scene(setup, 0.5, 30 * kDegree, friction, 0); },
                       {kFrom, 0.5 * (kFrom + kTo), kTo}, [=](const Setup&, const std::vector<Stand>& s) {
                         // Second difference over equal intervals.
                         const double half = 0.5 * (kTo - kFrom);
                         const double a = (s[3].mean.x() - 2 * s[2].mean.x() + s[1].mean.x()) / (half * half);
                         const double formula = kGravity * (std::sin(30 * kDegree) - friction * std::cos(30 * kDegree));
                         return std::abs(a - formula) / formula;
                       });
}

Measure sticking_block() {
  constexpr double kEdge = 0.5;
  return block_measure([=](const Setup& setup) { return block_scene(setup, kEdge, 26.0 * kDegree, 0.5, 0); }, {0.4, 2.4},
                       [](const Setup&, const std::vector<Stand>& s) { return std::abs(s[2].mean.x() - s[1].mean.x()) / kEdge; });
}

}  // namespace crumple::lab::chart
