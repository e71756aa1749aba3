// FORMULAS F1: what falls freely, whatever its model.
#include "tests/sim/world/world_bodies.h"

namespace crumple::sim {
namespace {

// v_n = -g n dt and y_n = -g dt^2 n (n + 1) / 2: after 1 s -5.06850, -4.98675 and -4.9254375 m for dt = 1/30, 1/60,
// 1/240.
TEST(FreeFall, OfEveryModelIsTheDiscreteParabola) {
  for (const auto& [rate, fall] : {std::pair{30, 5.06850}, {60, 4.98675}, {240, 4.9254375}}) {
    SceneDescription scene;
    scene.dt = 1.0 / rate;
    scene.bodies = {soft_block("block", {2, 2, 2}, 0.25, at(0, 0, 0)), barrel("barrel", at(10, 0, 0)),
                    ball("ball", 0.2, 2, at(20, 0, 0))};
    const auto world = make_world(scene);
    const Vec3 start = world->pose(0).p_WB;
    for (int k = 0; k < rate; ++k) world->step();
    EXPECT_NEAR(start.y() - world->pose(0).p_WB.y(), fall, 1e-12 * fall) << "block";
    EXPECT_NEAR(-world->pose(1).p_WB.y(), fall, 2e-12 * fall) << "barrel";  // its origin, past its centre of mass
    EXPECT_NEAR(-world->pose(2).p_WB.y(), fall, 1e-12 * fall) << "ball";
    for (BodyId body : {0, 1, 2}) EXPECT_NEAR(world->velocity(body).y(), -9.81, 9.81e-12) << body;
  }
}

}  // namespace
}  // namespace crumple::sim
