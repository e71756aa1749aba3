#include "common/text.h"
#include "server/lab/stability/beam_and_modes.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/lab/stability/stored_mesh.h"
#include "server/sim/world.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>

// Rows about extreme materials and shapes of elements.
namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;

constexpr double kDt = 1.0 / 60;             // [s]
constexpr double kMostFloatCondition = 1e6;  // unwarned, STABILITY 8

// Of the matrix of a step of the body at rest.
double condition_number(const sim::TetMesh& mesh, const FemMaterial& material) {
  SoftTrial trial(mesh, material, {});
  sim::fem::StepSystem system(false);
  sim::fem::assemble(trial.rest, mesh.tets, trial.state, trial.force, kDt, {}, trial.pool, system);
  const Eigen::MatrixXd A(system.to_sparse());
  const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
  return eigenvalues.maxCoeff() / eigenvalues.minCoeff();
}

// Nothing: no world could be made of it.
std::optional<bool> world_warns_of_float(const sim::TetMesh& mesh, const FemMaterial& material) {
  sim::SceneDescription scene{.dt = kDt, .float_solver = true};
  sim::FemModel model;
  model.mesh = std::make_shared<sim::TetMesh>(mesh);
  model.material = material;
  scene.bodies = {{.name = "cube", .model = model}};
  auto world = sim::World::create(scene, {.threads = 1});
  if (!world) return std::nullopt;
  const std::vector<sim::Event> events = (*world)->take_events();
  return std::ranges::any_of(events, [](const sim::Event& event) { return event.kind == sim::EventKind::warning; });
}

Outcome stiffness(const Method& method, const Effort& effort) {
  double worst_residual = 0, highest = 0;
  bool sound = true;
  int capped = 0;
  std::string broken;
  double warned = 0, silent = 0;  // float_solver: least E with a warning, largest condition number without one
  for (double young = 1e3; young < 2e11; young *= effort.brief ? 1e4 : 10) {
    FemMaterial material = soft_material();
    material.young = young;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), material, method.fem);
    scramble(trial, 2);
    trial.run(std::max(2.0, 10 * std::sqrt(material.density / young)), kDt);  // ten times that a wave needs through it
    const bool well = trial.sound() && trial.inverted() == 0;
    if (well)
      highest = young;
    else
      broken += text(" ", young);
    sound = sound && trial.sound();
    if (trial.sound()) worst_residual = std::max(worst_residual, trial.worst_residual);
    capped += trial.capped;
    if (!method.fem.float_matrix) continue;
    const std::optional<bool> warns = world_warns_of_float(trial.mesh, material);
    sound = sound && warns.has_value();
    if (!warns.value_or(false)) silent = std::max(silent, condition_number(trial.mesh, material));
    else if (warned == 0) warned = young;
  }
  std::string found = text("recovers up to E = ", highest, " Pa", broken.empty() ? "" : "; not at E =" + broken,
                           "; worst residual ", worst_residual, ", ", capped, " capped solves");
  if (method.fem.float_matrix) {
    found += warned > 0 ? text("; float_solver warns from E = ", warned, " Pa on,") : text("; float_solver never warns,");
    found += text(" at condition numbers above ", silent);
  }
  if (sound && !broken.empty()) return {Verdict::fails, 1, found};
  if (sound && silent > kMostFloatCondition) return {Verdict::limit, silent, found};
  return judged(sound, capped == 0, capped, found);
}

Outcome incompressibility(const Method& method, const Effort& effort) {
  std::string broken, locking;
  bool sound = true;
  double worst = 0;
  for (const double nu : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
    FemMaterial material = soft_material();
    material.poisson = nu;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), material, method.fem);
    scramble(trial, 3);
    trial.run(2, kDt);
    sound = sound && trial.sound();
    if (!trial.sound() || trial.inverted() > 0) broken += text(" ", nu);
    const double ratio = cantilever_ratio(method.fem, nu);
    worst = std::max(worst, 1 - ratio);
    locking += text(" ", nu, ": ", ratio);
  }
  std::string cook;
  for (const double nu : {0.3, 0.49, 0.4999}) {
    const double ratio = cook_ratio(method.fem, nu, effort.brief ? 8 : 16);
    worst = std::max(worst, 1 - ratio);
    cook += text(" ", nu, ": ", cook_ratio(method.fem, nu, 8), effort.brief ? "" : text(" and ", ratio));
  }
  const std::string found =
      text(broken.empty() ? "every scramble recovers" : "scramble does not recover at nu =" + broken,
           "; Cook's membrane over quadratic tets, 8", effort.brief ? "" : " and 16", " cells across, nu:", cook,
           "; tip of a slender beam over beam theory, nu:", locking);
  if (sound && !broken.empty()) return {Verdict::fails, 1, found};
  return judged(sound, worst < 0.2, worst, found);
}

// Part of its spin that a plate of 1 m x 1 cm, E = 1e9, turning about a diameter at 10 rad/s, has after a step: its
// tets are clamped.
double spin_kept_by_thin_plate(const FemMethod& method) {
  FemMaterial material;
  material.young = 1e9;
  SoftTrial plate(block({1, 0.01, 1}, {4, 1, 4}), material, method);
  const Vec3 middle = plate.centre();
  for (int i = 0; i < plate.mesh.node_count(); ++i)
    plate.state.v[i] = Vec3(10, 0, 0).cross(Vec3(plate.mesh.X[i] - middle));
  const double before = plate.spin();
  method.step(plate, kDt);
  return plate.spin() / before;
}

Outcome slivers(const Method& method, const Effort& effort) {
  std::string found;
  bool sound = true, refused = true;
  double shape = 0;
  int left = 0;
  for (const double quality : {1e-4, 1e-8, 0.0, -0.1}) {
    const sim::TetMesh mesh = cube_with_sliver(3, quality);
    if (!sim::validate(mesh, "mesh")) {
      found += text(" ", quality, ": refused at load;");
      refused = refused && quality <= 0;
      continue;
    }
    refused = refused && quality > 0;
    SoftTrial trial(mesh, soft_material(), method.fem);
    scramble(trial, 1);
    trial.run(effort.brief ? 1 : 4, kDt);
    sound = sound && trial.sound();
    const int inverted = trial.inverted();
    left = std::max(left, inverted);
    shape = std::max(shape, trial.shape_error());
    found += text(" ", quality, ": ", inverted, " inverted;");
  }
  // What keeps slivers from being stiff, the clamp of the basis matrices, against a turn: with Q frozen in a step a
  // clamped tet's force is not blind to it.
  const double kept = spin_kept_by_thin_plate(method.fem);
  found = text("scrambled cube with a tet squashed to", found, " shape error ", 100 * shape,
               " %; the bunny (S09 L0, 6V/L^3 = 9.4e-4) ");
  if (method.fem.element == sim::fem::ElementKind::hexahedra) {
    found += "is no lattice";
  } else if (const auto bunny = stored_mesh(effort.references / "S09_bunny_hung" / "L0.json")) {
    FemMaterial material = soft_material();
    material.young = 2e5;
    material.poisson = 0.35;
    SoftTrial trial(*bunny, material, method.fem);
    Eigen::AlignedBox3d box;
    for (const Vec3& X : bunny->X) box.extend(X);
    Random random(1);
    trial.deform([&](const Vec3&) -> Vec3 { return box.min() + random.vec3(0, 1).cwiseProduct(box.sizes()); });
    trial.run(2, kDt);
    sound = sound && trial.sound();
    const int inverted = trial.sound() ? trial.inverted() : trial.mesh.tet_count();
    left = std::max(left, inverted);
    found += text("scrambled: ", inverted, " of ", trial.mesh.tet_count(), " inverted");
  } else {
    found += effort.brief ? "is left to the full run" : "is not at hand";
  }
  found += text("; a thin plate with clamped tets (1 m x 1 cm, E = 1e9, 10 rad/s) keeps ", 100 * kept,
                " % of its spin in a step");
  if (sound && !refused) return {Verdict::fails, 1, found};
  return judged(sound, left == 0, left, found);
}

}  // namespace

std::vector<Row> element_rows() {
  return {
      {8,
       "Stiffness",
       "The scrambled cube, E = 1e3 to 1e11 Pa, dt = 1/60 s, for ten passes of a wave",
       "bounded, nothing inverted, no solve ends at its cap; float_solver warns of a condition number above 1e6",
       Family::fem,
       stiffness,
       4},
      {9,
       "nu towards 0.5",
       "The scrambled cube, nu = 0.3 to 0.4999; Cook's membrane (S10) over quadratic tets and a slender beam's tip "
       "over "
       "beam theory (1: no locking)",
       "bounded, nothing inverted; locking below 20 %",
       Family::fem,
       incompressibility,
       3,
       {{"mixed u-p or F-bar elements", "an element that does not lock"},
        {"quadratic tets", "an element that does not lock"}}},
      {11, "Slivers",
       "The scrambled cube with one tet squashed to 1e-4, 1e-8, 0 and -0.1 of its height; the bunny (S09 L0) scrambled",
       "zero and negative volume refused at load; else bounded, and nothing inverted; what clamping does to a turn is "
       "reported",
       Family::fem, slivers, 15},
  };
}

}  // namespace crumple::lab::stability
