#pragma once

#include <gtest/gtest.h>

#include "server/authoring/barrel_asset.h"
#include "server/sim/world.h"
#include "tests/support/kuhn_lattice.h"

// Bodies for scenes of this folder's tests.
namespace crumple::sim {

inline Pose at(double x, double y, double z) { return {Quat::Identity(), Vec3(x, y, z)}; }

// Cells of edge H from the pose's origin; solved so well that sums over nodes hold to rounding.
inline BodyDescription soft_block(const std::string& name, std::array<int, 3> cells, double H, const Pose& pose,
                                  const Vec3& velocity = Vec3::Zero(), double young = 1e5) {
  FemModel model;
  model.mesh = std::make_shared<TetMesh>(test::kuhn_lattice(cells, H));
  model.material.young = young;
  model.material.cg_tolerance = 1e-12;
  model.material.cg_max_iterations = 2000;
  return {.name = name, .pose = pose, .velocity = velocity, .model = model};
}

// A motion of a lattice's nodes at X = 0: without keys they are held.
inline NodeMotion end_of(const FemModel& model) {
  NodeMotion end;
  for (int n = 0; n < model.mesh->node_count(); ++n)
    if (model.mesh->X[n].x() < 1e-9) end.nodes.push_back(n);
  return end;
}

inline BodyDescription ball(const std::string& name, double radius, double mass, const Pose& pose,
                            const Vec3& velocity = Vec3::Zero()) {
  RigidModel model;
  model.shapes.push_back({Pose{}, Sphere{radius}});
  model.mass = mass;
  return {.name = name, .pose = pose, .velocity = velocity, .model = model};
}

inline BodyDescription ground() {
  RigidModel model{.kind = RigidKind::fixed};
  model.shapes.push_back({Pose{}, Plane{}});
  return {.name = "ground", .model = model};
}

// .66 x .9 m along y, 20 kg; dents above 1 N s.
inline BodyDescription barrel(const std::string& name, const Pose& pose, const Vec3& velocity = Vec3::Zero()) {
  static const auto set = std::make_shared<example_based::ExampleSet>(*authoring::make_barrel_asset());
  ExampleModel model{.set = set, .mass = 20};
  model.parameters.beta = 1;
  return {.name = name, .pose = pose, .velocity = velocity, .model = model};
}

inline SceneDescription empty_space(std::vector<BodyDescription> bodies) {
  SceneDescription scene;
  scene.gravity = Vec3::Zero();
  scene.bodies = std::move(bodies);
  return scene;
}

inline std::unique_ptr<World> make_world(const SceneDescription& scene, int threads = 1) {
  auto world = World::create(scene, {.threads = threads});
  EXPECT_TRUE(world) << world.error().text();
  return world ? std::move(*world) : nullptr;
}

// Largest |d| over the nodes of the difference to a rigid translation.
inline double distortion(const World& world, BodyId body, const std::vector<Vec3>& X) {
  const FemView view = world.fem(body);
  double worst = 0;
  for (std::size_t n = 0; n < X.size(); ++n) worst = std::max(worst, ((view.x[n] - view.x[0]) - (X[n] - X[0])).norm());
  return worst;
}

}  // namespace crumple::sim
