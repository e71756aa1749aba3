// The scenes that are shipped, stepped from their files: what their descriptions promise happens.
#include "tests/integration/scene_run.h"
#include "tests/support/self_overlap.h"

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
  EXPECT_GT(run.events_of(sim::EventKind::fracture, "pane"), 2);
  EXPECT_GT(run.fragments("pane"), 5);
  EXPECT_EQ(run.frozen_bodies(), 0);
  EXPECT_LT(run.world().energies().kinetic, energy / 2);
}

TEST(ShippedScenes, TheWindowsGlassShattersAndItsFrameIsBent) {
  SceneRun run = run_shipped("window");
  ASSERT_TRUE(run.started());
  const std::size_t tets = run.world().fem(1).tets.size();
  run.step(240, kGround);
  EXPECT_GT(run.fragments("window"), 10);
  EXPECT_EQ(run.frozen_bodies(), 0);
  const sim::FemView view = run.world().fem(1);
  double bent = 0, flowed = 0;
  for (std::size_t t = 0; t < tets; ++t) {
    if (view.material_id[t] != 0) {
      EXPECT_TRUE(view.plastic_strain[t].isZero(0));
      continue;
    }
    flowed = std::max(flowed, view.plastic_strain[t].norm());
    for (const int n : view.tets[t]) bent = std::min(bent, view.x[n].z() + 0.04);
  }
  EXPECT_GT(flowed, 0.05);
  EXPECT_LT(bent, -0.1);  // [m], the post, two seconds after the blow
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

TEST(ShippedScenes, TheWallLosesBricksAndDustWhereTheBallHitsIt) {
  SceneRun run = run_shipped("wall");
  ASSERT_TRUE(run.started());
  run.step(150, kGround);
  EXPECT_GT(run.fragments("wall"), 10);
  EXPECT_GT(run.events_of(sim::EventKind::dust, "wall"), 3);
  EXPECT_LT(run.world().pose(run.world().find("ball")).p_WB.z(), -0.5);  // it went through
  EXPECT_EQ(run.frozen_bodies(), 0);
}

// The scenes of Parker & O'Brien (2009).

TEST(ShippedScenes, TheDetentionUnitStandsUntilTheChargeAndBurstsAllRound) {
  SceneRun run = run_shipped("detention");
  ASSERT_TRUE(run.started());
  run.step(30, kGround);
  EXPECT_EQ(run.events_of(sim::EventKind::fracture, "pane 1"), 0);
  run.step(25, kGround);
  for (const std::string pane : {"pane 1", "pane 2", "pane 3", "pane 4"}) EXPECT_GT(run.fragments(pane), 10) << pane;
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(ShippedScenes, TheGatesLeavesBendForGoodAndTear) {
  SceneRun run = run_shipped("gate");
  ASSERT_TRUE(run.started());
  run.step(110, kGround);
  int pieces = 0;
  for (const std::string leaf : {"leaf left", "leaf right"}) {
    const sim::FemView view = run.world().fem(run.world().find(leaf));
    double largest = 0;
    for (const Mat3& plastic : view.plastic_strain) largest = std::max(largest, plastic.norm());
    EXPECT_GT(largest, 0.02) << leaf;
    EXPECT_GT(run.events_of(sim::EventKind::fracture, leaf), 0) << leaf;
    pieces += view.fragments;
  }
  EXPECT_GT(pieces, 2);
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(ShippedScenes, TheRamBreaksThePlanksThatItMeets) {
  SceneRun run = run_shipped("planks");
  ASSERT_TRUE(run.started());
  run.step(60, kGround);
  EXPECT_GT(run.fragments("plank 3") + run.fragments("plank 4"), 3);
  EXPECT_EQ(run.fragments("plank 1"), 1);
  EXPECT_EQ(run.fragments("plank 6"), 1);
}

TEST(ShippedScenes, ThePoleStoresEnergyBurstsAndBreaksPanesWithItsShards) {
  SceneRun run = run_shipped("pole");
  ASSERT_TRUE(run.started());
  run.step(110, kGround);
  EXPECT_EQ(run.fragments("pole"), 1);
  const double stored = run.world().energies().elastic;
  EXPECT_GT(stored, 1000);
  run.step(70, kGround);
  EXPECT_GT(run.fragments("pole"), 20);
  run.step(60, kGround);
  EXPECT_LT(run.world().energies().elastic, stored / 4);
  int broken = 0;
  for (const char* pane : {"pane 1", "pane 2", "pane 3", "pane 4"}) broken += run.fragments(pane) > 5;
  EXPECT_GE(broken, 1);
}

TEST(ShippedScenes, TheRopeIsWoundOntoTheSpoolAndOntoItself) {
  double overlap[2] = {0, 0};  // largest part of the rope's volume
  for (const bool asks : {false, true}) {
    v1::Scene scene = shipped_scene("rope");
    EXPECT_TRUE(body_of(scene, "rope").fem().self_contact());
    body_of(scene, "rope").mutable_fem()->set_self_contact(asks);
    SceneRun run(scene, shipped_scene_file("rope").parent_path());
    ASSERT_TRUE(run.started());
    const BodyId rope = run.world().find("rope");
    const sim::FemView start = run.world().fem(rope);
    const sim::TetMesh rest{.X = start.x, .tets = start.tets};
    for (int k = 0; k < 17; ++k) {
      run.step(100, kGround);
      overlap[asks] = std::max(overlap[asks], self_overlap(rest, run.world().fem(rope).x));
    }
    if (!asks) continue;
    const sim::FemView view = run.world().fem(rope);
    const Vec3 axis = run.world().pose(run.world().find("spool")).p_WB;
    int near = 0;
    for (const Vec3& x : view.x) near += Eigen::Vector2d(x.x() - axis.x(), x.y() - axis.y()).norm() < 0.35;
    EXPECT_GT(near, 0.5 * static_cast<double>(view.x.size()));
    EXPECT_EQ(view.inverted, 0);
  }
  EXPECT_GT(overlap[0], 0.015);  // a chaotic run: five times what contact leaves is enough to tell
  EXPECT_LT(overlap[1], 0.003);
}

TEST(ShippedScenes, TheTrestleStandsAndFallsWithItsPosts) {
  SceneRun run = run_shipped("trestle");
  ASSERT_TRUE(run.started());
  const double deck = run.world().pose(run.world().find("stringer +0.00")).p_WB.y();
  run.step(40, kGround);
  EXPECT_NEAR(run.world().pose(run.world().find("stringer +0.00")).p_WB.y(), deck, 0.03);
  run.step(210, kGround);
  EXPECT_LT(run.world().pose(run.world().find("stringer +0.00")).p_WB.y(), deck - 0.5);
}

// Cranes stand until they are struck; a ship through all three takes them apart, and parts dent.
TEST(ShippedScenes, TheShipyardsCranesStandUntilTheShipTakesThemApart) {
  constexpr double kBar = 0.2;  // [m], about as thick as a bar of a crane: what is drawn is thinner than the hull that meets the ground, and dented
  SceneRun run = run_shipped("shipyard");
  ASSERT_TRUE(run.started());
  run.step(150, kGround);
  EXPECT_EQ(run.events_of(sim::EventKind::parted, "crane 1 part 1"), 0);
  EXPECT_GT(run.world().pose(run.world().find("ship")).p_WB.x(), -25);
  run.step(1050, kBar);
  for (const char* mast : {"crane 1 part 2", "crane 2 part 2", "crane 3 part 2"}) EXPECT_EQ(run.events_of(sim::EventKind::parted, mast), 1) << mast;
  EXPECT_GT(run.events_of(sim::EventKind::dent, "ship"), 0);
}

// Figure 7: what there is to dent to decides. Height of what a car is now, in its own axes [m].
double height_of(const SceneRun& run, const std::string& car) {
  const BodyId id = run.world().find(car);
  const Frame frame = run.world().capture();
  const Pose X_WB = run.world().pose(id);
  double low = 1e9, high = -1e9;
  for (const Vec3f& p : frame.bodies[id].positions) {
    const double y = (X_WB.R_WB.conjugate() * (p.cast<double>() - X_WB.p_WB)).y();
    low = std::min(low, y);
    high = std::max(high, y);
  }
  return high - low;
}

TEST(ShippedScenes, ACarIsFlattenedWhereItHasAFlattenedExample) {
  SceneRun run = run_shipped("falling_cars");
  ASSERT_TRUE(run.started());
  const double rest = height_of(run, "car with");
  EXPECT_NEAR(rest, height_of(run, "car without"), 1e-4);
  run.step(1300, 0.2);
  EXPECT_LT(height_of(run, "car with"), 0.67 * rest);  // the example itself: 0.4
  EXPECT_GT(height_of(run, "car without"), 0.7 * rest);  // none of its examples is lower
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(ShippedScenes, CannonballsDentACarFromAllRoundUntilAnotherFlattensIt) {
  double height[2] = {0, 0};
  for (const bool flattened : {false, true}) {
    SceneRun run = run_shipped(flattened ? "cannonballs" : "cannonballs_plain");
    ASSERT_TRUE(run.started());
    const double rest = height_of(run, "car");
    run.step(1350, 0.2);
    EXPECT_GE(run.events_of(sim::EventKind::dent, "car"), 8);
    EXPECT_GT(run.dent("car"), 0.5);
    const double struck = height_of(run, "car");
    run.step(300, 0.2);
    height[flattened] = height_of(run, "car");
    EXPECT_GT(struck, 0.85 * rest);
    EXPECT_LT(run.world().pose(run.world().find("car")).p_WB.norm(), 3);  // it is still where the other one falls
    EXPECT_TRUE(run.weights_are_a_simplex("car"));
  }
  EXPECT_LT(height[true], 0.9 * height[false]);
}

}  // namespace
}  // namespace crumple::test
