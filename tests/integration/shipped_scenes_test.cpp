// The scenes that are shipped, stepped from their files: what their descriptions promise happens.
#include "tests/integration/scene_run.h"

namespace crumple::test {
namespace {

// A shard may dig in by less than half a cell of its pane [m]: overlaps are taken back at a bounded speed.
constexpr double kGround = 0.1;

TEST(ShippedScenes, ThePaneShattersAndTakesTheBallsEnergy) {
  SceneRun run = run_shipped("pane");
  ASSERT_TRUE(run.started());
  EXPECT_EQ(run.fragments("pane"), 1);
  const double energy = run.world().energies().kinetic;
  run.step(200, kGround);
  EXPECT_GT(run.events_of(sim::EventKind::fracture, "pane"), 5);
  EXPECT_GT(run.fragments("pane"), 5);
  EXPECT_EQ(run.frozen_bodies(), 0);
  EXPECT_LT(run.world().energies().kinetic, energy / 2);
}

TEST(ShippedScenes, TheBarrelsAreDentedByTheDock) {
  SceneRun run = run_shipped("barrels");
  ASSERT_TRUE(run.started());
  run.step(400, kGround);
  for (const std::string barrel : {"barrel 1", "barrel 2", "barrel 3"}) {
    EXPECT_GT(run.events_of(sim::EventKind::dent, barrel), 0) << barrel;
    EXPECT_GT(run.dent(barrel), 0.1) << barrel;
    EXPECT_TRUE(run.weights_are_a_simplex(barrel)) << barrel;
  }
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(ShippedScenes, TheCarDentsBarrelsAndItselfAndBreaksTheGlass) {
  SceneRun run = run_shipped("crash");
  ASSERT_TRUE(run.started());
  run.step(250, kGround);
  EXPECT_GT(run.dent("car"), 0.1);
  int dented = 0;
  for (int k = 1; k <= 9; ++k) {
    const std::string barrel = "barrel " + std::to_string(k);
    EXPECT_TRUE(run.weights_are_a_simplex(barrel)) << barrel;
    dented += run.dent(barrel) > 0.1;
  }
  EXPECT_TRUE(run.weights_are_a_simplex("car"));
  EXPECT_GE(dented, 6);  // those that the car meets
  EXPECT_GT(run.events_of(sim::EventKind::fracture, "glass middle"), 0);
  EXPECT_GT(run.fragments("glass middle"), 1);
  EXPECT_EQ(run.frozen_bodies(), 0);
}

}  // namespace
}  // namespace crumple::test
