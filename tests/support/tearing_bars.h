#pragma once

#include "server/sim/scene.h"
#include "tests/support/kuhn_lattice.h"

#include <memory>
#include <string>

namespace crumple::test {

// `count` brittle bars side by side that are torn apart by their ends, one after another, `between` [s] from one to the next; then a
// ball that falls; then, if wanted, a soft block of 12 x 12 x 2 cells that nothing breaks.
inline sim::SceneDescription tearing_bars(int count, double between = 0.05, bool with_block = false) {
  sim::SceneDescription scene;
  for (int b = 0; b < count; ++b) {
    sim::FemModel bar;
    bar.mesh = std::make_shared<sim::TetMesh>(kuhn_lattice({6, 1, 1}, 0.1));
    bar.material.breakable = true;
    bar.material.toughness = 1e4;
    sim::NodeMotion left, right;
    for (int n = 0; n < bar.mesh->node_count(); ++n) {
      if (bar.mesh->X[n].x() < 0.01) left.nodes.push_back(n);
      if (bar.mesh->X[n].x() > 0.59) right.nodes.push_back(n);
    }
    const double begin = b * between;
    if (begin > 0) right.keys.push_back({0, Pose{}});
    right.keys.push_back({begin, Pose{}});
    right.keys.push_back({begin + 0.1, Pose{Quat::Identity(), Vec3(0.3, 0, 0)}});
    bar.motions = {left, right};
    scene.bodies.push_back({.name = "bar " + std::to_string(b), .pose = {Quat::Identity(), Vec3(0, 0, b)}, .model = bar});
  }
  sim::RigidModel ball;
  ball.shapes.push_back({Pose{}, sim::Sphere{0.2}});
  scene.bodies.push_back({.name = "ball", .pose = {Quat::Identity(), Vec3(3, 1, 0)}, .model = ball});
  if (with_block) {
    sim::FemModel block;
    block.mesh = std::make_shared<sim::TetMesh>(kuhn_lattice({12, 12, 2}, 0.1));
    scene.bodies.push_back({.name = "block", .pose = {Quat::Identity(), Vec3(6, 0, 0)}, .model = block});
  }
  return scene;
}

}  // namespace crumple::test
