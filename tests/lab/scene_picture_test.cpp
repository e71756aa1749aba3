#include "server/lab/scene_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple::lab {
namespace {

// A triangle that faces the camera and its light alike in every picture below.
struct Drawn {
  Topology topology;
  Frame frame;

  Drawn() {
    BodyTopology body{.model = BodyModel::example_based, .deformable = true};
    body.triangles = {{0, 1, 2}};
    body.colour = {0.1f, 0.1f, 0.1f};
    topology.bodies = {body};
    frame.bodies = {{.id = 0, .positions = {Vec3f(0, 0, 0), Vec3f(1, 0, 0), Vec3f(0, 1, 0)}}};
  }
  std::array<int, 3> colour() const {
    const auto seen = patches(topology, frame, {.eye = Vec3(0, 0, 4), .target = Vec3::Zero()}, 100, 100);
    EXPECT_EQ(seen.size(), 1u);
    return seen.at(0).rgb;
  }
};

TEST(ScenePicture, VerticesTakeTheColoursOfTheirChannels) {
  Drawn drawn;
  const auto own = drawn.colour();
  drawn.frame.bodies[0].values.assign(6, 0);
  const auto rest = drawn.colour();
  EXPECT_EQ(rest[0], rest[2]);  // grey
  EXPECT_GT(rest[0], own[0] + 50);
  drawn.frame.bodies[0].values = {1, 1, 1, 0, 0, 0};
  const auto first = drawn.colour();
  drawn.frame.bodies[0].values = {0, 0, 0, 1, 1, 1};
  const auto second = drawn.colour();
  EXPECT_GT(first[0], 2 * first[2]);    // red
  EXPECT_GT(second[2], 2 * second[0]);  // blue
  drawn.frame.bodies[0].values = {0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f};
  for (const int k : {0, 1, 2}) {
    EXPECT_GE(drawn.colour()[k], std::min(first[k], second[k])) << k;
    EXPECT_LE(drawn.colour()[k], std::max(first[k], second[k])) << k;
  }
}

TEST(ScenePicture, StressIsShownOverTheBodysOwnColour) {
  Drawn drawn;
  drawn.topology.bodies[0].model = BodyModel::fem;
  const auto own = drawn.colour();
  drawn.frame.bodies[0].values = {0, 0, 0};
  EXPECT_EQ(drawn.colour(), own);
  drawn.frame.bodies[0].values = {1, 1, 1};
  EXPECT_GT(drawn.colour()[0], 2 * drawn.colour()[2]);
}

}  // namespace
}  // namespace crumple::lab
