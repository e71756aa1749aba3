#pragma once

#include "server/sim/scene.h"

namespace crumple::test {

// A box of 1 m that falls on the ground from 2 m, and a fixed ground.
inline sim::SceneDescription falling_box() {
  sim::SceneDescription scene;
  scene.name = "falling box";
  sim::RigidModel ground;
  ground.kind = sim::RigidKind::fixed;
  ground.shapes.push_back({Pose(), sim::Plane()});
  scene.bodies.push_back({.name = "ground", .model = ground});
  sim::RigidModel box;
  box.shapes.push_back({Pose(), sim::Box()});
  scene.bodies.push_back({.name = "box", .pose = {Quat::Identity(), Vec3(0, 2, 0)}, .model = box});
  return scene;
}

}  // namespace crumple::test
