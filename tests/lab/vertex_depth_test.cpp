#include "server/lab/vertex_depth.h"

#include "server/lab/benchmark_scenes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace crumple::lab {
namespace {

// The pile's: side 1 m about its origin, 1000 kg, E = 1e6.
sim::BodyDescription cube(const std::string& name, const Pose& pose) {
  sim::BodyDescription body = pile_scene().bodies.front();
  body.name = name;
  body.pose = pose;
  return body;
}

sim::BodyDescription ground() {
  sim::RigidModel model{.kind = sim::RigidKind::fixed};
  model.shapes.push_back({Pose{}, sim::Plane{}});
  return {.name = "ground", .model = model};
}

std::unique_ptr<sim::World> world_of(const sim::SceneDescription& scene) {
  auto world = sim::World::create(scene);
  EXPECT_TRUE(world.has_value());
  return std::move(*world);
}

TEST(VertexDepth, IsTheDistanceToTheOtherBodysSurfaceOrToThePlane) {
  sim::SceneDescription scene;
  scene.bodies = {cube("a", {Quat::Identity(), Vec3(0, 5, 0)}), ground()};
  EXPECT_EQ(vertex_depth(*world_of(scene), scene), 0);
  scene.bodies[0].pose.p_WB.y() = 0.47;
  EXPECT_NEAR(vertex_depth(*world_of(scene), scene), 0.03, 1e-12);
  // A second cube's vertices, a quarter of a metre aside and 0.07 m below the first one's top.
  scene.bodies[0].pose.p_WB.y() = 1.5;
  scene.bodies.push_back(cube("b", {Quat::Identity(), Vec3(0.25, 2.43, 0.25)}));
  EXPECT_NEAR(vertex_depth(*world_of(scene), scene), 0.07, 1e-12);
}

// Were a corner's contact as weak as its overlap is small, it would sink in by 60 mm.
TEST(VertexDepth, ACubesCornerStandsOnAnotherCube) {
  sim::SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.sleep.speed = 0;
  const Quat on_corner = Quat::FromTwoVectors(Vec3(1, 1, 1), Vec3::UnitY());
  scene.bodies = {cube("below", {Quat::Identity(), Vec3(0, 0.5, 0)}),
                  cube("above", {on_corner, Vec3(0, 1 + 0.5 * std::sqrt(3.0), 0)}), ground()};
  const auto world = world_of(scene);
  for (int k = 1; k <= 30; ++k) {
    world->step();
    EXPECT_LT(vertex_depth(*world, scene), 0.025) << k;
  }
}

// Contact against what is asked of the pile, 20 mm, and half of it. Soft cubes that meet are squeezed, and what squeezes them drives their
// faces on after they have come to rest on each other: by contact looked for with the last velocities alone by a step's whole way.
TEST(VertexDepth, OfCubesThatMeetStaysSmall) {
  for (const double speed : {3.0, 6.0, 9.0}) {
    for (const double turn : {0.0, 0.3, 0.7}) {
      sim::SceneDescription scene;
      scene.bodies = {cube("lower", {Quat::Identity(), Vec3(0, 0, 0)}),
                      cube("upper", {Quat(Eigen::AngleAxisd(turn, Vec3::UnitY())), Vec3(0.1, 1.2, 0.2)})};
      scene.bodies[1].velocity = Vec3(0, -speed, 0);
      auto world = world_of(scene);
      double deepest = 0;
      for (int k = 0; k < 40; ++k) {
        world->step();
        deepest = std::max(deepest, vertex_depth(*world, scene));
      }
      EXPECT_LT(deepest, 0.012) << speed << ' ' << turn;
      EXPECT_LT(world->velocity(0).y(), -0.3 * speed) << speed << ' ' << turn;  // they have met
    }
  }
}

}  // namespace
}  // namespace crumple::lab
