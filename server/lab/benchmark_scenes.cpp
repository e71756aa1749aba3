#include "server/lab/benchmark_scenes.h"

#include "common/text.h"
#include "server/authoring/shapes/barrel.h"
#include "server/authoring/shapes/node_sets.h"
#include "server/lab/scene_bodies.h"

#include <cmath>
#include <random>

namespace crumple::lab {
namespace {

using authoring::Side;
using sim::BodyDescription;
using sim::SceneDescription;

constexpr int kIterations = 3000;  // enough for every scene to converge: a capped solve would be a faster wrong answer

}  // namespace

Result<SceneDescription> beam_scene(const BeamOptions& options) {
  auto mesh = authoring::beam(options.size, options.cells, options.lattice);
  if (!mesh) return std::unexpected(mesh.error());
  SceneDescription scene{.name = "beam", .dt = 1.0 / 60, .sleep = kNeverSleeps};
  sim::FemModel fem;
  fem.material.young = options.young;
  fem.material.poisson = options.poisson;
  fem.material.damping_mass = options.damping_mass;
  fem.material.damping_stiffness = options.damping_stiffness;
  fem.material.cg_max_iterations = kIterations;
  fem.motions.push_back({authoring::nodes_on_side(mesh->X, Side::min_x), {}});
  fem.mesh = std::make_shared<sim::TetMesh>(std::move(*mesh));
  BodyDescription body{.name = "beam"};
  body.model = fem;
  scene.bodies.push_back(body);
  return scene;
}

SceneDescription pile_scene() {
  SceneDescription scene{.name = "pile", .dt = 1.0 / 60, .sleep = kNeverSleeps};
  sim::FemModel cube;
  cube.mesh = std::make_shared<sim::TetMesh>(*authoring::centred_box_mesh(Vec3::Ones(), {2, 2, 2}, authoring::Lattice::femfx));
  cube.material.cg_max_iterations = kIterations;
  cube.material.friction = 0.4;
  for (int k = 0; k < 64; ++k) {
    const int i = k % 4, j = k / 4 % 4, l = k / 16;
    const double s = l % 2 == 1 ? 0.5 : -0.5;
    BodyDescription body{.name = text("cube ", k)};
    body.pose.p_WB = {(i - 1.5) * 2 + 0.3 * std::sin(12.9898 * k) + s, 1 + 1.3 * l, (j - 1.5) * 2 + 0.3 * std::sin(78.233 * k) + s};
    body.pose.R_WB = Eigen::AngleAxisd(0.3 * std::sin(39.425 * k), Vec3::UnitY());
    body.model = cube;
    scene.bodies.push_back(body);
  }
  scene.bodies.push_back(plane_body("ground", Vec3::UnitY(), 0, 0.4));
  scene.bodies.push_back(plane_body("left", Vec3::UnitX(), -4.5, 0.4));
  scene.bodies.push_back(plane_body("right", -Vec3::UnitX(), -4.5, 0.4));
  scene.bodies.push_back(plane_body("back", Vec3::UnitZ(), -4.5, 0.4));
  scene.bodies.push_back(plane_body("front", -Vec3::UnitZ(), -4.5, 0.4));
  return scene;
}

SceneDescription panel_scene() {
  SceneDescription scene{.name = "panel", .dt = 1.0 / 60, .sleep = kNeverSleeps};
  auto mesh = std::make_shared<sim::TetMesh>(*authoring::pane(2, 2, 0.05, {20, 20, 1}, authoring::Lattice::femfx));
  sim::FemModel fem;
  fem.material.young = 1e7;
  fem.material.poisson = 0.2;
  fem.material.density = 2500;
  fem.material.breakable = true;
  fem.rigid_fragments = 24;
  fem.material.toughness = 1e5;
  fem.material.friction = 0.4;
  fem.material.cg_max_iterations = kIterations;
  const Side edges[] = {Side::min_x, Side::max_x, Side::min_y, Side::max_y};
  fem.motions.push_back({authoring::nodes_on_sides(mesh->X, edges), {}});
  fem.mesh = mesh;
  BodyDescription panel{.name = "panel"};
  panel.pose.p_WB = {0, 1.01, 0};
  panel.model = fem;
  scene.bodies.push_back(panel);

  BodyDescription box = solid_body("box", sim::Box{Vec3::Constant(0.1)}, sim::RigidKind::dynamic, {0.03, 1.02, 2.0});
  std::get<sim::RigidModel>(box.model).mass = 20;
  box.velocity = {0, 0, -40};
  scene.bodies.push_back(box);
  scene.bodies.push_back(plane_body("ground", Vec3::UnitY(), 0, 0.4));
  return scene;
}

SceneDescription barrels_scene(std::uint64_t seed) {
  SceneDescription scene{.name = "barrels", .dt = 0.004, .sleep = kNeverSleeps};
  std::mt19937_64 random(seed);
  // std::uniform_real_distribution may differ between libraries; this does not.
  const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; };
  sim::RigidModel barrel;
  barrel.shapes.push_back({Pose{}, sim::ConvexHull{authoring::barrel_surface(authoring::plain_barrel()).vertices}});
  barrel.mass = 20;
  for (int l = 0; l < 5; ++l) {
    for (int c = 0; c < 10; ++c) {
      BodyDescription body{.name = text("barrel ", 10 * l + c)};
      body.pose.p_WB = {1.1 * (c - 4.5), 8.2 + 1.15 * l, uniform(-1, 1)};
      body.pose.R_WB = Quat(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
      body.model = barrel;
      scene.bodies.push_back(body);
    }
  }
  for (int r = 0; r < 5; ++r) {
    for (int c = -4; c <= 4; ++c) {
      BodyDescription peg = solid_body(text("peg ", r, " ", c), sim::Cylinder{0.12, 2}, sim::RigidKind::fixed,
                                  {1.2 * c + 0.6 * (r % 2), 1.5 + 1.2 * r, 0});
      peg.pose.R_WB = Quat::FromTwoVectors(Vec3::UnitY(), Vec3::UnitZ());
      scene.bodies.push_back(peg);
    }
  }
  scene.bodies.push_back(plane_body("floor", Vec3::UnitY(), 0, 0.5));
  for (double side : {-1.0, 1.0}) {
    scene.bodies.push_back(solid_body(text("wall z ", side), sim::Box{{6, 20, 0.2}}, sim::RigidKind::fixed, {0, 20, 2.2 * side}));
    scene.bodies.push_back(solid_body(text("wall x ", side), sim::Box{{0.2, 20, 2.4}}, sim::RigidKind::fixed, {6 * side, 20, 0}));
  }
  return scene;
}

}  // namespace crumple::lab
