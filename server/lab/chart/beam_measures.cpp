#include "common/text.h"
#include "server/authoring/shapes/node_sets.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"

#include <cmath>

namespace crumple::lab::chart {
namespace {

using authoring::Lattice;

constexpr const char* kSwing = "S12_dynamics_step_load";
constexpr double kSecond = 1;                                  // [s]
constexpr double kConvergedTip = -0.4793;                      // of beam B at rest [m]: converged 3D corotational

struct Scene {
  sim::SceneDescription description;
  std::vector<int> probe;
};

void apply(const Setup& setup, sim::SceneDescription& scene) {
  scene.dt = setup.dt;
  scene.integrator = setup.integrator;
  scene.float_solver = setup.float_solver;
  scene.solver = setup.solver;
  scene.unguarded = !setup.guarded;
  auto& model = std::get<sim::FemModel>(scene.bodies[0].model);
  model.element = setup.element;
  auto& material = model.material;
  material.cg_tolerance = setup.cg_tolerance;
  material.cg_max_iterations = setup.cg_cap;
  material.rotation = setup.rotation;
}

Result<Scene> beam(const Setup& setup, const BeamOptions& options) {
  auto made = beam_scene(options);
  if (!made) return std::unexpected(made.error());
  Scene scene{std::move(*made), {}};
  apply(setup, scene.description);
  scene.probe = authoring::nodes_on_side(std::get<sim::FemModel>(scene.description.bodies[0].model).mesh->X, authoring::Side::max_x);
  return scene;
}

Result<Scene> beam_b(const Setup& setup, double damping = 0) {
  // The beam that others measured has 25 x 4 x 4 cells; its coarser and finer relatives keep the proportion.
  const int n = setup.cells, along = n == 4 && setup.lattice == Lattice::kuhn ? 25 : 6 * n;
  return beam(setup, {.lattice = setup.lattice, .cells = {along, n, n}, .size = {1, 0.16, 0.16}, .young = 1e6,
                      .damping_mass = damping, .damping_stiffness = 0});
}

Result<Scene> beam_a_scene(const Setup& setup) { return beam(setup, {.lattice = Lattice::femfx, .cells = {25, 4, 4}}); }

// S12's mesh and material; without the case its twin, which is the same box on the same lattice.
Result<Scene> swing_scene(const Setup& setup, const Workshop& workshop) {
  Scene scene;
  scene.description.name = "swing";
  scene.description.gravity = {0, 0, -9.81};
  sim::FemModel fem;
  fem.material = {.young = 1e6, .poisson = 0.3, .density = 1000};
  fem.clamp_limit = 1e9;  // the references know no clamped basis matrices
  sim::NodeMotion held;
  if (workshop.has(kSwing)) {
    auto level = read_level(workshop.yardstick / kSwing, "L0");
    if (!level) return std::unexpected(level.error());
    for (const Dirichlet& d : level->dirichlet) {
      if (d.dof == 0) held.nodes.push_back(d.node);
    }
    scene.probe = {level->tip};
    fem.mesh = std::make_shared<sim::TetMesh>(std::move(level->mesh));
  } else {
    auto mesh = authoring::box_mesh({.size = {1, 0.1, 0.1}, .cells = {10, 2, 2}, .lattice = Lattice::kuhn, .minimum = Vec3::Zero()});
    if (!mesh) return std::unexpected(mesh.error());
    held.nodes = authoring::nodes_on_side(mesh->X, authoring::Side::min_x);
    scene.probe = authoring::nodes_in_box(mesh->X, {0.999, 0.049, 0.049}, {1.001, 0.051, 0.051});
    fem.mesh = std::make_shared<sim::TetMesh>(std::move(*mesh));
  }
  fem.motions.push_back(held);
  sim::BodyDescription body{.name = "beam"};
  body.model = fem;
  scene.description.bodies.push_back(body);
  apply(setup, scene.description);
  return scene;
}

Sample to_sample(const Motion& motion, const Setup& setup) {
  Sample sample;
  sample.values = {{"seconds", motion.seconds}, {"iterations", motion.iterations}, {"ms_per_step", 1000 * motion.seconds * setup.dt},
                   {"capped_steps", motion.capped_steps}, {"energy", motion.energy}, {"energy_lost", motion.energy_lost}};
  sample.values.insert(motion.stages.values.begin(), motion.stages.values.end());
  sample.failure = motion.failure;
  // Where the cap is the knob, ending at it is the setting.
  if (motion.capped_steps > 0 && setup.cg_cap >= Setup{}.cg_cap) sample.failure = text(motion.capped_steps, " steps ended at the cap");
  return sample;
}

template <class Make>
std::function<Result<std::uint64_t>(const Setup&, Workshop&)> hash_of(Make make) {
  return [make](const Setup& setup, Workshop& workshop) -> Result<std::uint64_t> {
    auto scene = make(setup, workshop);
    if (!scene) return std::unexpected(scene.error());
    return scene_hash(scene->description);
  };
}

// ---- references that this code makes, once ------------------------------------------------------------------------

using Make = std::function<Result<Scene>(const Setup&)>;

// nodes, or tip, of the direct run.
Result<std::vector<double>> direct(Workshop& workshop, const std::string& name, const Make& make, const Setup& setup, bool tip) {
  const std::string key = text(name, tip ? " tip" : " nodes", " direct, lattice ", static_cast<int>(setup.lattice), ", cells ",
                               setup.cells, ", steps a second ", std::lround(1 / setup.dt), ", rule ", static_cast<int>(setup.rotation), ", integrator ",
                               static_cast<int>(setup.integrator), setup.element == sim::fem::ElementKind::linear_tetrahedra ? "" : text(", element ", static_cast<int>(setup.element)));
  if (const auto at = workshop.arrays.find(key); at != workshop.arrays.end()) return at->second;
  auto scene = make(setup);
  if (!scene) return std::unexpected(scene.error());
  auto motion = step_directly(scene->description, kSecond, scene->probe);
  if (!motion) return std::unexpected(motion.error());
  return workshop.arrays[key] = tip ? motion->tip : motion->nodes;
}

std::vector<double> extrapolated(const std::vector<double>& coarse, const std::vector<double>& fine, double weight) {
  std::vector<double> limit;
  for (std::size_t k = 0; k < fine.size(); ++k) limit.push_back(fine[k] + weight * (fine[k] - coarse[k]));
  return limit;
}

// The tip of a mesh for dt to zero: backward Euler is of first order, so twice the finer run less the coarser one. Its
// uncertainty: half the change from the extrapolation before, which it should at least halve.
Result<std::vector<double>> small_steps(Workshop& workshop, const std::string& name, const Make& make, Setup setup) {
  setup.integrator = sim::Integrator::backward_euler;  // the limit is the same, the extrapolation is not
  const double finest = workshop.quick ? 480 : 960;
  std::vector<std::vector<double>> tips;
  for (double part : {4.0, 2.0, 1.0}) {
    setup.dt = part / finest;
    auto tip = direct(workshop, name, make, setup, true);
    if (!tip) return std::unexpected(tip.error());
    tips.push_back(std::move(*tip));
  }
  const auto before = extrapolated(tips[0], tips[1], 1), limit = extrapolated(tips[1], tips[2], 1);
  workshop.floors[text(name, " dt ", static_cast<int>(setup.lattice), " ", setup.cells)] = 0.5 * relative_l2(before, limit);
  return limit;
}

// The tip of beam B for mesh and dt to zero: small steps on a bcc lattice, plus what the mesh still changes at a moderate
// dt (the two errors add up to first order), extrapolated in second order. Its uncertainty: a quarter of the change
// from the extrapolation before, which it should cut to a fourth at least, and that of the small steps.
Result<std::vector<double>> truth_of_beam_b(Workshop& workshop) {
  const std::string key = "beam b truth";
  if (const auto at = workshop.arrays.find(key); at != workshop.arrays.end()) return at->second;
  const Make make = [](const Setup& s) { return beam_b(s); };
  Setup setup{.dt = 1.0 / 120, .lattice = Lattice::bcc};
  std::vector<std::vector<double>> tips;
  const int finest = workshop.quick ? 4 : 8;
  for (int part : {4, 2, 1}) {
    setup.cells = finest / part;
    auto scene = make(setup);
    if (!scene) return std::unexpected(scene.error());
    std::get<sim::FemModel>(scene->description.bodies[0].model).material.cg_tolerance = 1e-7;  // far below what is sought
    auto motion = step_world(scene->description, 1, kSecond, scene->probe);
    if (!motion) return std::unexpected(motion.error());
    tips.push_back(motion->tip);
  }
  Setup base{.lattice = Lattice::bcc, .cells = 2};
  auto at_rest_dt = small_steps(workshop, "beam b", make, base);
  if (!at_rest_dt) return std::unexpected(at_rest_dt.error());
  // cells 2 is tips[0] of the full set, tips[1] of the quick one.
  const std::vector<double>& same = workshop.quick ? tips[1] : tips[0];
  const auto before = extrapolated(tips[0], tips[1], 1.0 / 3), limit = extrapolated(tips[1], tips[2], 1.0 / 3);
  std::vector<double> truth(limit.size());
  for (std::size_t k = 0; k < truth.size(); ++k) truth[k] = (*at_rest_dt)[k] + limit[k] - same[k];
  workshop.floors[key] = 0.25 * relative_l2(before, limit) + workshop.floors[text("beam b dt ", static_cast<int>(Lattice::bcc), " 2")];
  return workshop.arrays[key] = truth;
}

}  // namespace

Measure beam_against_direct_solves() {
  const auto make = [](const Setup& s, const Workshop&) { return beam_b(s); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            auto reference = direct(workshop, "beam b", [](const Setup& s) { return beam_b(s); }, setup, false);
            if (!reference) return std::unexpected(reference.error());
            auto motion = step_world(scene->description, setup.threads, kSecond, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            Sample sample = to_sample(*motion, setup);
            sample.values["error"] = relative_l2(motion->nodes, *reference);
            sample.values["error_max"] = largest_of_samples(motion->nodes, *reference, motion->nodes.size() * 3 / motion->tip.size());
            return sample;
          },
          hash_of(make)};
}

Measure beam_total_error() {
  const auto make = [](const Setup& s, const Workshop&) { return beam_b(s); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            const Make simple = [](const Setup& s) { return beam_b(s); };
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            auto truth = truth_of_beam_b(workshop);
            if (!truth) return std::unexpected(truth.error());
            auto exact = direct(workshop, "beam b", simple, setup, true);
            if (!exact) return std::unexpected(exact.error());
            const std::string key = text("beam b small steps ", static_cast<int>(setup.lattice), " ", setup.cells);
            if (!workshop.arrays.contains(key)) {
              auto made = small_steps(workshop, "beam b", simple, setup);
              if (!made) return std::unexpected(made.error());
              workshop.arrays[key] = *made;
            }
            auto motion = step_world(scene->description, setup.threads, kSecond, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            Sample sample = to_sample(*motion, setup);
            // All parts by the truth's size, so that they can be compared and bound the total.
            const std::vector<double> zero(truth->size(), 0.0);
            const auto part = [&](const std::vector<double>& a, const std::vector<double>& b) {
              return relative_l2(a, b) * relative_l2(b, zero) / relative_l2(*truth, zero);
            };
            sample.values["error"] = relative_l2(motion->tip, *truth);
            sample.values["floor"] = workshop.floors["beam b truth"];
            sample.values["error_solver"] = part(motion->tip, *exact);
            sample.values["error_time"] = part(*exact, workshop.arrays[key]);
            sample.values["error_mesh"] = part(workshop.arrays[key], *truth);
            return sample;
          },
          hash_of(make)};
}

Measure beam_at_rest() {
  constexpr double kDamping = 6, kEnd = 4;  // [1/s], [s]: a little above critical; what still moves then is 1e-5
  const auto make = [](const Setup& s, const Workshop&) { return beam_b(s, kDamping); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            auto motion = step_world(scene->description, setup.threads, kEnd, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            Sample sample = to_sample(*motion, setup);
            const double tip = motion->tip[motion->tip.size() - 2];
            sample.values["error"] = std::abs(tip - kConvergedTip) / std::abs(kConvergedTip);
            sample.values["tip"] = tip;
            return sample;
          },
          hash_of(make)};
}

Measure beam_a() {
  constexpr double kOnMesh = -0.11785, kEnd = 10;  // equilibrium of this mesh [m], [s]
  const auto make = [](const Setup& s, const Workshop&) { return beam_a_scene(s); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            auto motion = step_world(scene->description, setup.threads, workshop.quick ? 0.4 * kEnd : kEnd, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            Sample sample = to_sample(*motion, setup);
            const double tip = motion->tip[motion->tip.size() - 2];
            sample.values["error"] = std::abs(tip - kOnMesh) / std::abs(kOnMesh);
            sample.values["tip"] = tip;
            return sample;
          },
          hash_of(make)};
}

Measure swing() {
  const auto make = [](const Setup& s, const Workshop& w) { return swing_scene(s, w); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            if (!workshop.arrays.contains("swing")) {
              if (workshop.has(kSwing)) {
                auto file = read_json(workshop.yardstick / kSwing / "corot_swing.json");
                if (!file) return std::unexpected(file.error());
                const std::vector<Vec3>& X = std::get<sim::FemModel>(scene->description.bodies[0].model).mesh->X;
                std::vector<double> tip;
                for (std::size_t k = 4; k < (*file)["tip"].size(); k += 4) {  // an entry a 1/60 s
                  for (int c = 0; c < 3; ++c) tip.push_back((*file)["tip"][k][c].get<double>() - X[scene->probe[0]][c]);
                }
                workshop.arrays["swing"] = tip;
                workshop.floors["swing"] = 3e-6;  // its own Richardson estimate
              } else {
                auto own = small_steps(workshop, "own swing", [&](const Setup& s) { return swing_scene(s, workshop); }, Setup{});
                if (!own) return std::unexpected(own.error());
                workshop.arrays["swing"] = *own;
                workshop.floors["swing"] = workshop.floors[text("own swing dt ", static_cast<int>(Setup{}.lattice), " ", Setup{}.cells)];
              }
            }
            auto motion = step_world(scene->description, setup.threads, kSecond, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            Sample sample = to_sample(*motion, setup);
            sample.values["error"] = relative_l2(motion->tip, workshop.arrays["swing"]);
            sample.values["error_max"] = largest_of_samples(motion->tip, workshop.arrays["swing"], 3);
            sample.values["floor"] = workshop.floors["swing"];
            return sample;
          },
          hash_of(make)};
}

Measure beam_cost() {
  const auto make = [](const Setup& s, const Workshop&) { return beam_b(s); };
  return {[=](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto scene = make(setup, workshop);
            if (!scene) return std::unexpected(scene.error());
            auto motion = step_world(scene->description, setup.threads, 4 * kSampleInterval, scene->probe);
            if (!motion) return std::unexpected(motion.error());
            return to_sample(*motion, setup);
          },
          hash_of(make)};
}

}  // namespace crumple::lab::chart
