// Bodies of every model in one world: determinism, and contact both ways.
#include "tests/sim/world/world_bodies.h"

#include <algorithm>

namespace crumple::sim {
namespace {

// A soft block on the ground, a barrel that falls on it, a ball that falls on the barrel.
SceneDescription heap() {
  SceneDescription scene;
  scene.bodies = {soft_block("block", {2, 2, 2}, 0.3, at(-0.3, 0.01, -0.3), Vec3(0, -1, 0)),
                  barrel("barrel", at(0.05, 1.15, 0), Vec3(0, -3, 0)), ball("ball", 0.2, 5, at(0.1, 1.9, 0.05), Vec3(0, -6, 0)),
                  ground()};
  std::get<FemModel>(scene.bodies[0].model).material.cg_tolerance = 1e-5;
  return scene;
}

std::uint64_t hash_after(const SceneDescription& scene, int steps, int threads) {
  const auto world = make_world(scene, threads);
  int contacts = 0;
  for (int k = 0; k < steps; ++k) contacts += world->step().contacts;
  EXPECT_GT(contacts, 0);
  EXPECT_LT(world->example_weights(1).col(0).minCoeff(), 0.99) << "the barrel must be dented for this to say anything";
  return world->state_hash();
}

TEST(World, SameSceneGivesTheSameBitsRunTwiceAndWithTwoThreads) {
  const std::uint64_t hash = hash_after(heap(), 25, 1);
  EXPECT_EQ(hash_after(heap(), 25, 1), hash);
  EXPECT_EQ(hash_after(heap(), 25, 2), hash);
}

TEST(World, TheHashSeesEveryBody) {
  const auto hash_of = [](const Vec3& block, const Vec3& barrel_v, const Vec3& ball_v) {
    auto world = make_world(empty_space({soft_block("block", {1, 1, 1}, 0.3, at(0, 0, 0), block), barrel("barrel", at(3, 0, 0), barrel_v),
                                         ball("ball", 0.2, 5, at(6, 0, 0), ball_v)}));
    world->step();
    return world->state_hash();
  };
  const Vec3 none = Vec3::Zero(), tiny(1e-12, 0, 0);
  const std::uint64_t hash = hash_of(none, none, none);
  EXPECT_EQ(hash_of(none, none, none), hash);
  EXPECT_NE(hash_of(tiny, none, none), hash);
  EXPECT_NE(hash_of(none, tiny, none), hash);
  EXPECT_NE(hash_of(none, none, tiny), hash);
}

TEST(World, ABallLosesWhatTheSoftBlockItHitsGains) {
  auto world = make_world(empty_space({soft_block("block", {2, 2, 2}, 0.25, at(0, 0, 0)),
                                       ball("ball", 0.15, 10, at(-0.2, 0.27, 0.24), Vec3(4, 0, 0))}));
  const double block_mass = 1000 * 0.125;
  const Vec3 before = world->energies().momentum;
  EXPECT_NEAR((before - Vec3(40, 0, 0)).norm(), 0, 1e-12);
  const double energy = world->energies().kinetic;
  int contacts = 0;
  for (int k = 0; k < 60; ++k) {
    contacts += world->step().contacts;
    const Vec3 total = world->energies().momentum;
    EXPECT_LT((total - before).norm(), 1e-8 * before.norm()) << "step " << k;  // four orders above the solve's tolerance
  }
  EXPECT_GT(contacts, 0);
  const Vec3 lost = before - 10 * world->velocity(1), gained = block_mass * world->velocity(0);
  EXPECT_GT(gained.x(), 5);
  EXPECT_LT((gained - lost).norm(), 1e-8 * before.norm());
  EXPECT_GT(distortion(*world, 0, test::kuhn_lattice({2, 2, 2}, 0.25).X), 1e-4);
  EXPECT_LT(world->energies().kinetic + world->energies().elastic, energy);
}

TEST(World, AMirroredSceneGivesTheMirroredMotion) {
  // A ball meets a ball: the lattice of a soft block is not mirror-symmetric, its free motion is.
  const auto run = [](double side) {
    auto world = make_world(empty_space({ball("a", 0.2, 2, at(side, 0.1, 0), Vec3(-3 * side, 0, 0)), ball("b", 0.2, 1, at(0, 0, 0))}));
    for (int k = 0; k < 60; ++k) world->step();
    return world->velocity(1);
  };
  const Vec3 right = run(1), left = run(-1);
  EXPECT_GT(left.x(), 0.5);
  EXPECT_NEAR(left.x(), -right.x(), 1e-9);
  EXPECT_NEAR(left.y(), right.y(), 1e-9);
}

TEST(World, ASoftBlockAndABarrelDentEachOther) {
  auto world = make_world(empty_space({soft_block("block", {2, 2, 2}, 0.2, at(0.5, -0.2, -0.2), Vec3(-6, 0, 0)), barrel("barrel", at(0, 0, 0))}));
  const Vec3 before = world->energies().momentum;
  EXPECT_EQ(world->example_weights(1).col(0).minCoeff(), 1);
  int plastic = 0, contacts = 0;
  for (int k = 0; k < 60; ++k) {
    const StepReport report = world->step();
    plastic += report.plastic_impulses;
    contacts += report.contacts;
  }
  EXPECT_GT(contacts, 0);
  EXPECT_GT(plastic, 0);
  EXPECT_LT(world->example_weights(1).col(0).minCoeff(), 0.99);   // the barrel is dented ...
  EXPECT_LT(world->velocity(1).x(), -0.5);                        // ... and pushed away,
  EXPECT_GT(world->velocity(0).x(), -5.9);                        // the block slowed
  EXPECT_GT(distortion(*world, 0, test::kuhn_lattice({2, 2, 2}, 0.2).X), 1e-3);  // ... and deformed.
  EXPECT_LT((world->energies().momentum - before).norm(), 1e-6 * before.norm());
  const auto events = world->take_events();
  const auto dent = std::find_if(events.begin(), events.end(), [](const Event& e) { return e.kind == EventKind::dent; });
  ASSERT_NE(dent, events.end());
  EXPECT_EQ(dent->body, 1u);
  EXPECT_GT(dent->magnitude, 1);
  EXPECT_NEAR(dent->point.x(), 0.3, 0.1);  // on the side that was hit
}

TEST(World, SoftBlockComesToRestOnTheGround) {
  SceneDescription scene;
  scene.bodies = {soft_block("block", {1, 1, 1}, 0.5, at(0, 0.05, 0), Vec3::Zero(), 1e6), ground()};
  auto world = make_world(scene);
  for (int k = 0; k < 240; ++k) world->step();
  EXPECT_LT(world->velocity(0).norm(), 1e-3);
  EXPECT_NEAR(world->pose(0).p_WB.y(), 0.25, 0.01);
}

TEST(World, StagesAreTimedWhenSomebodyKeepsAClock) {
  auto world = make_world(heap());
  world->step();
  EXPECT_TRUE(world->stage_times().empty());
  static double now = 0;
  now = 0;
  world->set_clock([] { return now += 1; });
  world->step();
  std::vector<std::string> names;
  for (const StageTime& stage : world->stage_times()) {
    names.push_back(stage.name);
    // inside the deformation of its barrels the clock is asked as well
    if (std::string(stage.name) == "examples") EXPECT_GT(stage.ms, 1);
    else EXPECT_EQ(stage.ms, 1) << stage.name;
  }
  EXPECT_EQ(names, (std::vector<std::string>{"commands", "kinematic", "detect", "assemble", "guard", "solve", "rigid", "examples", "plasticity", "fracture", "sleep"}));
  const example_based::ExampleTimes& parts = world->example_times();
  for (double ms : {parts.locate, parts.projection, parts.propagation}) EXPECT_GT(ms, 0);
}

TEST(World, ABadSceneMakesNoWorld) {
  SceneDescription scene = empty_space({soft_block("block", {1, 1, 1}, 0.5, at(0, 0, 0))});
  std::get<FemModel>(scene.bodies[0].model).material.poisson = 0.5;
  const auto world = World::create(scene);
  ASSERT_FALSE(world);
  EXPECT_EQ(world.error().field, "bodies[0].fem.material.poisson_ratio");
}

TEST(World, ABodyThatLeavesTheRangeOfNumbersIsHeldAndNothingElseStops) {
  const auto scene = empty_space({soft_block("light", {1, 1, 1}, 0.1, at(0, 0, 0)), soft_block("other", {1, 1, 1}, 0.1, at(20, 0, 0), Vec3(1, 0, 0)),
                                  ball("ball", 0.1, 1, at(40, 0, 0), Vec3(0, 1, 0)), ball("light ball", 0.1, 1e-3, at(60, 0, 0))});
  auto world = make_world(scene), undisturbed = make_world(scene);
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, 0, 1e9), .point = Vec3::Zero(), .radius = 10}));
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 3, .impulse = Vec3(0, 0, 1e9), .point = Vec3(60, 0, 0)}));
  std::vector<Event> events;
  for (int k = 0; k < 10; ++k) {
    world->step();
    undisturbed->step();
    for (const Event& event : world->take_events()) {
      if (event.kind == EventKind::frozen) events.push_back(event);
    }
  }
  ASSERT_EQ(events.size(), 2u);  // one a body, once
  EXPECT_EQ(events[0].body, 0u);
  EXPECT_EQ(events[1].body, 3u);
  EXPECT_EQ(world->fem(0).x, std::get<FemModel>(scene.bodies[0].model).mesh->X) << "held where it was";
  for (const Vec3& v : world->fem(0).v) EXPECT_EQ(v, Vec3::Zero());
  EXPECT_TRUE(world->pose(3).p_WB.allFinite());
  EXPECT_EQ(world->fem(1).x, undisturbed->fem(1).x);
  EXPECT_EQ(world->pose(2).p_WB, undisturbed->pose(2).p_WB);
  EXPECT_TRUE(world->energies().momentum.allFinite());
}

TEST(World, TheGroundIsDrawnUnderAllThatIsOnIt) {
  for (const double far : {0.0, -90.0}) {
    const auto world = make_world(empty_space({ground(), ball("ball", 1, 1, at(far, 1, 0))}));
    float lowest = 0;
    for (const Vec3f& v : world->topology().bodies[0].vertices) lowest = std::min(lowest, v.x());
    if (far == 0) EXPECT_EQ(lowest, -10);
    else EXPECT_LT(lowest, far - 20);
  }
}

}  // namespace
}  // namespace crumple::sim
