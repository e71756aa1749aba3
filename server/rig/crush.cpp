#include "server/rig/crush.h"

#include "common/text.h"
#include "server/authoring/boundary_fit.h"
#include "server/authoring/enclosing_mesh.h"
#include "server/rig/press_frame.h"
#include "server/sim/mesh/embedding.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple::rig {
namespace {

using sim::example_based::ExampleSet;

constexpr double kDt = 1.0 / 240;  // [s]
constexpr int kFewestTets = 200;
// Strain is additive: a tet whose plastic strain has an eigenvalue of -1 is at rest where it is flat, and beyond that
// where it is inside out. Without a trace, that takes a norm of sqrt(3/2); with 2 a car ended in 206 inverted tets.
constexpr double kMostPlastic = 0.6;

sim::SceneDescription press_scene(const std::shared_ptr<const sim::TetMesh>& mesh, const CrushOptions& o, double extent,
                                  double size) {
  sim::SceneDescription scene;
  scene.name = "press";
  scene.gravity = Vec3::Zero();
  scene.dt = kDt;
  scene.sleep.speed = 0;
  sim::RigidModel plane{.kind = sim::RigidKind::fixed, .shapes = {{{}, sim::Plane{}}}};
  scene.bodies.push_back({.name = "plane", .pose = {}, .model = plane});

  sim::FemModel metal;
  metal.mesh = mesh;
  metal.material.density = 1000;
  metal.material.young = metal.material.density * std::pow(kWaveSpeed * size, 2);
  metal.material.damping_mass = 2;
  metal.material.damping_stiffness = 2e-4;
  metal.material.flow = sim::fem::FlowRule::deviatoric;
  metal.material.yield = o.yield_strain;
  metal.material.creep = 0.9;
  metal.material.max_plastic = kMostPlastic;
  scene.bodies.push_back({.name = "body", .pose = {}, .model = metal});

  const double thick = 0.5 * size, gap = 0.002 * size;
  sim::RigidModel plate{.kind = sim::RigidKind::kinematic, .shapes = {{{}, sim::Box{Vec3(2 * size, thick, 2 * size)}}}};
  const auto at = [&](double y) { return Pose{Quat::Identity(), Vec3(0, y + thick, 0)}; };
  plate.motion = {
      {0, at(extent + gap)}, {kPress, at((1 - o.depth) * extent)}, {kPress + kRelease, at(extent + 0.2 * size)}};
  scene.bodies.push_back({.name = "plate", .pose = at(extent + gap), .model = plate});
  return scene;
}

Result<void> check(const ExampleSet& set, const CrushOptions& o) {
  if (!(o.depth > 0 && o.depth <= 0.6)) return invalid("depth", text("is ", o.depth, ", must be in (0, 0.6]"));
  if (!(o.yield_strain >= 1e-4 && o.yield_strain <= 1))
    return invalid("yield_strain", text("is ", o.yield_strain, ", must be in [1e-4, 1]"));
  if (set.render.triangles.empty())
    return invalid("render", "is not in the asset, must be: its copy is what comes out");
  assert(o.axis >= 0 && o.axis < 3);
  return {};
}

}  // namespace

Result<sim::TetMesh> tets_to_press(const ExampleSet& set, const CrushOptions& o) {
  if (auto ok = check(set, o); !ok) return std::unexpected(ok.error());
  auto enclosing =
      authoring::enclosing_mesh(set.render, {.tet_budget = std::max(set.mesh.tet_count() * 5 / 4, kFewestTets)});
  if (!enclosing) return std::unexpected(enclosing.error());
  return authoring::fitted_to_surface(*enclosing, set.render);
}

Result<Crushed> crush(const ExampleSet& set, const std::string& name, const CrushOptions& o,
                      const std::function<void(double)>& progress) {
  const auto rest = tets_to_press(set, o);
  if (!rest) return std::unexpected(rest.error());
  const PressFrame frame(rest->X, o.axis, o.from_max);
  auto turned = std::make_shared<sim::TetMesh>(*rest);
  for (Vec3& p : turned->X) p = frame.in_press(p);
  const double extent = frame.extent;

  auto world = sim::World::create(press_scene(turned, o, extent, frame.size), {.threads = o.threads});
  if (!world) return std::unexpected(world.error());
  const BodyId body = (*world)->find("body");
  const int steps = static_cast<int>(std::lround((kPress + kRelease + kRest) / kDt));
  for (int k = 0; k < steps; ++k) {
    (*world)->step();
    if (progress) progress((k + 1.0) / steps);
  }

  const sim::FemView view = (*world)->fem(body);
  Crushed out{.copy = {name, {}}, .report = {.inverted_tets = view.inverted, .steps = steps}};
  for (const Mat3& strain : view.plastic_strain)
    out.report.plastic_strain = std::max(out.report.plastic_strain, strain.norm());
  const auto released = frame.released(view.x, rest->X);
  if (!released) return std::unexpected(released.error());
  out.report.thickness = released->thickness;
  out.copy.vertices.resize(set.render.vertices.size());
  sim::embedded_positions(sim::embed(set.render.vertices, *rest), rest->tets, released->x, out.copy.vertices);
  return out;
}

}  // namespace crumple::rig
