#include <algorithm>
#include <cmath>

#include "tests/sim/world/world_bodies.h"

// Islands that sleep and wake (Parker & O'Brien 2009, section 4), in whole worlds.
namespace crumple::sim {
namespace {

constexpr double kEdge = 0.5, kMass = 1000 * kEdge * kEdge * kEdge;

// A cube of 0.5 m, stiff enough to rest quickly.
BodyDescription cube(const std::string& name, const Pose& pose, const Vec3& velocity = Vec3::Zero()) {
  BodyDescription body = soft_block(name, {2, 2, 2}, kEdge / 2, pose, velocity, 1e7);
  auto& material = std::get<FemModel>(body.model).material;
  material.cg_tolerance = 1e-4;
  material.damping_stiffness = 0.002;
  return body;
}

BodyDescription box(const std::string& name, const Vec3& size, RigidKind kind, const Pose& pose) {
  RigidModel model{.kind = kind};
  model.shapes.push_back({Pose{}, Box{size / 2}});
  model.restitution = 0;
  return {.name = name, .pose = pose, .model = model};
}

SceneDescription grounded(std::vector<BodyDescription> bodies) {
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.bodies = std::move(bodies);
  scene.bodies.push_back(ground());
  return scene;
}

// Bodies a, a + 1, .. stand on each other.
SceneDescription stack(int count) {
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < count; ++k) bodies.push_back(cube("cube " + std::to_string(k), at(0.02 * (k % 2), 1.002 * kEdge * k, 0)));
  return grounded(std::move(bodies));
}

int asleep(const World& world) { return world.workload().asleep_bodies; }

// Steps until nothing is live. False: that takes more than `seconds`.
bool rest(World& world, double seconds = 8) {
  for (int k = 0; k * world.dt() < seconds; ++k)
    if (world.step().workload.live_bodies == 0) return true;
  return false;
}

double energy(const World& world) {
  const Energies e = world.energies();
  return e.kinetic + e.elastic + e.gravitational;
}

double lowest(const World& world, BodyId body) {
  const FemView view = world.fem(body);
  return std::ranges::min_element(view.x, {}, [](const Vec3& x) { return x.y(); })->y();
}

Result<void> poke(World& world, BodyId body, const Vec3& velocity, double mass = kMass) {
  return world.submit(ApplyImpulse{.body = body, .impulse = mass * velocity, .point = world.pose(body).p_WB, .radius = 1});
}

TEST(WorldSleep, ABodyAtRestFallsAsleepAndKeepsItsBits) {
  auto world = make_world(grounded({cube("cube", at(0, 0.1, 0))}));
  const StepReport before = world->step();
  EXPECT_EQ(before.workload.live_bodies, 1);
  EXPECT_EQ(before.workload.live_tets, 48);
  EXPECT_EQ(before.workload.live_nodes, 27);
  ASSERT_TRUE(rest(*world));
  EXPECT_TRUE(world->is_asleep(0));
  EXPECT_FALSE(world->is_asleep(1));  // the ground
  const std::vector<Vec3> x = world->fem(0).x;
  const Frame frame = world->capture(true);
  for (int k = 0; k < 200; ++k) {
    const StepReport report = world->step();
    EXPECT_EQ(report.contacts, 0);
    EXPECT_EQ(report.solver_iterations, 0);
    EXPECT_EQ(report.workload.asleep_tets, 48);
    EXPECT_EQ(report.workload.live_tets + report.workload.live_nodes, 0);
  }
  EXPECT_EQ(world->fem(0).x, x);
  for (const Vec3& v : world->fem(0).v) EXPECT_EQ(v, Vec3::Zero());
  const Frame later = world->capture(true);
  EXPECT_EQ(later.bodies[0].positions, frame.bodies[0].positions);
  EXPECT_EQ(later.bodies[0].values, frame.bodies[0].values);
}

TEST(WorldSleep, NothingSleepsWhereTheSceneForbidsIt) {
  SceneDescription scene = grounded({cube("cube", at(0, 0, 0))});
  scene.sleep.speed = 0;
  EXPECT_FALSE(rest(*make_world(scene), 4));
}

TEST(WorldSleep, APokeWakesItsIslandAndNoOther) {
  SceneDescription scene = stack(3);
  scene.bodies.insert(scene.bodies.begin() + 3, cube("apart", at(3, 0, 0)));
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world));
  const std::vector<Vec3> apart = world->fem(3).x;
  ASSERT_TRUE(poke(*world, 1, Vec3(0.1, 0, 0)));
  world->step();
  EXPECT_EQ(world->workload().live_bodies, 3);
  EXPECT_TRUE(world->is_asleep(3));
  for (int k = 0; k < 20; ++k) world->step();
  EXPECT_EQ(world->fem(3).x, apart);
  EXPECT_TRUE(rest(*world));
}

TEST(WorldSleep, AForceBelowTheThresholdIsNotFelt) {
  SceneDescription scene = grounded({cube("cube", at(0, 0, 0)), ball("ball", 0.2, 30, at(3, 0.2, 0))});
  scene.sleep.wake_acceleration = 0.5;
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world));
  const Vec3 centre = world->pose(0).p_WB, ball = world->pose(1).p_WB;
  const auto push = [&](double acceleration) {
    // On all nodes by their mass, so that each gets the same.
    std::vector<int> nodes;
    for (int n = 0; n < 27; ++n) nodes.push_back(n);
    ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = 0, .nodes = nodes, .impulse = Vec3(0, kMass * acceleration * world->dt(), 0)}));
    ASSERT_TRUE(world->submit(ApplyForce{.body = 1, .force = Vec3(0, 30 * acceleration, 0), .point = ball}));
  };
  push(0.45);
  world->step();
  EXPECT_EQ(asleep(*world), 2);
  EXPECT_EQ(world->pose(0).p_WB, centre);
  EXPECT_EQ(world->pose(1).p_WB, ball);
  push(0.55);
  world->step();
  EXPECT_EQ(asleep(*world), 0);
}

TEST(WorldSleep, AForceThatActsOnKeepsABodyAwake) {
  auto world = make_world(grounded({cube("cube", at(0, 0, 0))}));
  ASSERT_TRUE(world->submit(ApplyForce{.body = 0, .force = Vec3(0.1 * kMass, 0, 0), .point = Vec3::Constant(kEdge / 2), .radius = 1,
                                       .duration = 4}));
  EXPECT_FALSE(rest(*world, 4));
  EXPECT_TRUE(rest(*world, 1));
}

// STABILITY 28. Twenty in a row, touching, one of them poked.
TEST(WorldSleep, AChainOfTwentyWakesWithoutGainingEnergy) {
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < 20; ++k) bodies.push_back(cube("cube " + std::to_string(k), at(0.999 * kEdge * k, 0, 0)));
  auto world = make_world(grounded(std::move(bodies)));
  ASSERT_TRUE(rest(*world, 12));
  const double quiet = energy(*world);
  ASSERT_TRUE(poke(*world, 0, Vec3(2, 0, 0)));
  world->step();
  EXPECT_EQ(asleep(*world), 0);
  const double given = 0.5 * kMass * 2 * 2;
  for (int k = 0; k < 240; ++k) {
    world->step();
    ASSERT_LT(energy(*world), quiet + 1.01 * given) << k;
  }
  for (BodyId b = 0; b < 20; ++b) EXPECT_LT(lowest(*world, b), 0.005) << b;
}

TEST(WorldSleep, WakingGivesNoEnergy) {
  auto world = make_world(stack(5));
  ASSERT_TRUE(rest(*world, 12));
  const double quiet = energy(*world);
  const double push = 0.02;  // m/s
  ASSERT_TRUE(poke(*world, 2, Vec3(push, 0, 0)));
  for (int k = 0; k < 120; ++k) {
    world->step();
    EXPECT_LT(world->energies().kinetic, 2 * 0.5 * kMass * push * push) << k;
    EXPECT_LT(energy(*world) - quiet, 0.5 * kMass * push * push) << k;
  }
  EXPECT_TRUE(rest(*world));
}

TEST(WorldSleep, ADropWakesAStackBeforeItIsHit) {
  SceneDescription scene = stack(2);
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world));
  const double top = world->fem(1).x.back().y();
  scene.bodies.insert(scene.bodies.begin() + 2, cube("falls", at(0.05, 4, 0.03)));
  for (int k = 0; k < 2; ++k) scene.bodies[k].asleep = true;
  world = make_world(scene);
  while (asleep(*world) > 0 && world->time() < 3) world->step();
  EXPECT_EQ(world->workload().live_bodies, 3);
  EXPECT_NEAR(world->time(), std::sqrt(2 * (4 - top) / 9.81), 0.05);
  double worst = 0;
  for (int k = 0; k < 60; ++k) worst = std::max(worst, world->step().worst_penetration);
  // As the same fall on bodies that never slept: 8 m/s are 13 cm a step.
  scene.sleep.speed = 0;
  for (int k = 0; k < 2; ++k) scene.bodies[k].asleep = false;
  auto awake = make_world(scene);
  double usual = 0;
  for (int k = 0; k < 120; ++k) usual = std::max(usual, awake->step().worst_penetration);
  EXPECT_LT(worst, 1.5 * usual);
  EXPECT_GT(lowest(*world, 2), kEdge);
}

TEST(WorldSleep, ASupportThatAScriptTakesAwayLeavesNothingInTheAir) {
  for (const Vec3& way : {Vec3(3, 0, 0), Vec3(0, -0.4, 0), Vec3(0, 0.4, 0)}) {
    BodyDescription plate = box("plate", Vec3(1.5, 0.1, 1.5), RigidKind::kinematic, at(0, 0.95, 0));
    std::get<RigidModel>(plate.model).motion = {{0, plate.pose}, {6, plate.pose}, {6.5, at(way.x(), 0.95 + way.y(), way.z())}};
    RigidModel block = std::get<RigidModel>(box("", Vec3(0.4, 0.2, 0.4), RigidKind::dynamic, Pose{}).model);
    SceneDescription scene = grounded({plate, cube("cube", at(-0.25, 1, -0.25)), cube("upper", at(-0.25, 1.502, -0.25)),
                                       {.name = "block", .pose = at(-0.5, 1.1, -0.5), .model = block}});
    auto world = make_world(scene);
    ASSERT_TRUE(rest(*world, 5.5)) << way;
    while (world->time() < 6 - 1e-9) world->step();
    EXPECT_EQ(asleep(*world), 3);
    const double at_rest = world->pose(2).p_WB.y();
    for (int k = 0; k < 2; ++k) world->step();
    EXPECT_EQ(asleep(*world), 0) << way;
    while (world->time() < 7) world->step();
    if (way.x() == 0) EXPECT_NEAR(world->pose(2).p_WB.y(), at_rest + way.y(), 0.15) << way;
    if (way.x() == 0) continue;
    while (world->time() < 10) world->step();
    EXPECT_LT(lowest(*world, 1), 0.02);  // on the ground
    EXPECT_LT(lowest(*world, 2), kEdge + 0.05);
    EXPECT_LT(world->pose(3).p_WB.y(), 1);
  }
}

TEST(WorldSleep, ASupportThatBreaksLeavesNothingInTheAir) {
  BodyDescription shelf = soft_block("shelf", {8, 1, 2}, 0.25, at(0, 1, 0), Vec3::Zero(), 1e7);
  auto& model = std::get<FemModel>(shelf.model);
  model.material.cg_tolerance = 1e-4;
  model.material.damping_stiffness = 0.005;
  model.material.breakable = true;
  model.material.toughness = 4e5;
  model.motions.push_back(end_of(model));
  SceneDescription scene = grounded({shelf, cube("cube", at(1.3, 1.26, 0))});
  std::get<FemModel>(scene.bodies[1].model).material.density = 300;
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world, 20));
  ASSERT_EQ(world->fem(0).fragments, 1);
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, -9000, 0), .point = Vec3(0.6, 1.1, 0.25), .radius = 0.3}));
  int splits = 0;
  for (int k = 0; k < 180; ++k) splits += world->step().splits;
  EXPECT_GT(splits, 0);
  EXPECT_LT(lowest(*world, 1), 0.9);
}

TEST(WorldSleep, ASlowSlideIsNoRest) {
  BodyDescription block = cube("block", at(0, 0, 0));
  std::get<FemModel>(block.model).material.friction = 0;
  auto world = make_world(grounded({block}));
  for (int k = 0; k < 30; ++k) world->step();
  ASSERT_TRUE(poke(*world, 0, Vec3(0.003, 0, 0)));
  world->step();
  const double from = world->pose(0).p_WB.x(), start = world->time();
  EXPECT_FALSE(rest(*world, 5));
  EXPECT_NEAR(world->pose(0).p_WB.x() - from, 0.003 * (world->time() - start), 1e-3);
}

// A bar of 1.5 m that hangs from its upper end.
SceneDescription hanging_bar() {
  BodyDescription bar = soft_block("bar", {1, 6, 1}, 0.25, at(0, 2, 0), Vec3::Zero(), 3e5);
  auto& model = std::get<FemModel>(bar.model);
  model.material.cg_tolerance = 1e-3;
  model.material.damping_mass = 0.3;
  model.material.friction = 0;
  NodeMotion held;
  for (int n = 0; n < model.mesh->node_count(); ++n)
    if (model.mesh->X[n].y() > 1.5 - 1e-9) held.nodes.push_back(n);
  model.motions.push_back(held);
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.bodies = {bar};
  return scene;
}

// Struck until it sleeps, beside the same world without sleep until then [m]: how wide its lower end swings in the last second.
double swing_before_sleep(SceneDescription scene) {
  auto world = make_world(scene);
  scene.sleep.speed = 0;
  auto reference = make_world(scene);
  for (const auto& w : {world.get(), reference.get()}) {
    EXPECT_TRUE(w->submit(ApplyImpulse{.body = 0, .impulse = Vec3(60, 0, 0), .point = Vec3(0.125, 2, 0.125), .radius = 0.3}));
  }
  std::vector<double> tip;
  while (asleep(*world) == 0 && world->time() < 40) {
    world->step();
    if (asleep(*world) > 0) break;
    reference->step();
    EXPECT_TRUE(world->fem(0).x == reference->fem(0).x) << "step " << tip.size();
    if (testing::Test::HasFailure()) return 0;
    tip.push_back(world->fem(0).x[0].x());
  }
  EXPECT_EQ(asleep(*world), 1);
  if (tip.size() < 120) return 0;
  const auto [low, high] = std::minmax_element(tip.end() - 60, tip.end());
  return *high - *low;
}

// Until a swing is a fraction of a millimetre, each of its bits is that of a bar in a world without sleep. What touches something
// may swing twice as wide.
TEST(WorldSleep, ASwingIsLeftAloneUntilItIsSmall) {
  const double in_the_air = swing_before_sleep(hanging_bar());
  EXPECT_GT(in_the_air, 0.5e-3);
  EXPECT_LT(in_the_air, 1.5e-3);  // 0.5 mm each way from where the rest began, and what the last half second of swing was wider
  SceneDescription scene = hanging_bar();
  scene.bodies.push_back(box("floor", Vec3(2, 1, 2), RigidKind::fixed, at(0.125, 1.501, 0.125)));  // pressed in by 1 mm
  const double on_the_floor = swing_before_sleep(scene);
  EXPECT_GT(on_the_floor, 1.4 * in_the_air);
  EXPECT_LT(on_the_floor, 3e-3);
}

TEST(WorldSleep, FrictionHoldsAfterWaking) {
  SceneDescription scene = grounded({cube("block", at(0, 0, 0)), cube("upper", at(0, 1.001 * kEdge, 0))});
  scene.gravity = 9.81 * Vec3(std::sin(0.3), -std::cos(0.3), 0);  // mu = 0.5 holds up to 0.46
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world, 10));
  const double from = world->pose(1).p_WB.x();
  ASSERT_TRUE(poke(*world, 0, Vec3(0, -0.001, 0)));
  for (int k = 0; k < 60; ++k) world->step();
  EXPECT_LT(std::abs(world->pose(1).p_WB.x() - from), 2e-4);
}

TEST(WorldSleep, ABoxThatSleepsOnASoftBlockWakesWithIt) {
  // Hit by a box, which only the rigid room knows of, or by a push on the block below.
  for (const bool by_box : {true, false}) {
    SceneDescription scene = grounded({cube("block", at(0, 0, 0)),
                                       box("box", Vec3(0.4, 0.3, 0.4), RigidKind::dynamic, at(0.25, 0.652, 0.25))});
    if (by_box) scene.bodies.insert(scene.bodies.begin() + 2, box("missile", Vec3::Constant(0.15), RigidKind::dynamic, at(0.25, 40, 0.25)));
    auto world = make_world(scene);
    const int sleepers = by_box ? 1 : 0;  // live ones while the others sleep
    while (world->workload().live_bodies > sleepers && world->time() < 2.5) world->step();
    ASSERT_EQ(asleep(*world), 2);
    const Vec3 at_rest = world->pose(1).p_WB;
    EXPECT_EQ(world->velocity(1), Vec3::Zero());
    if (!by_box) ASSERT_TRUE(poke(*world, 0, Vec3(0, 0, 0.05)));
    double highest = 0, lowest_y = at_rest.y();
    bool woke = false;
    for (int k = 0; k < 180; ++k) {
      world->step();
      woke = woke || asleep(*world) == 0;
      highest = std::max(highest, world->pose(1).p_WB.y());
      lowest_y = std::min(lowest_y, world->pose(1).p_WB.y());
    }
    EXPECT_TRUE(woke);
    EXPECT_LT(highest, at_rest.y() + 0.05);
    EXPECT_GT(lowest_y, at_rest.y() - 0.1);
    ASSERT_TRUE(rest(*world, 20));
    EXPECT_NEAR(world->pose(1).p_WB.y(), at_rest.y(), 0.01);
  }
}

TEST(WorldSleep, RigidAndExampleBodiesSleepAndWakeAmongThemselves) {
  SceneDescription scene = grounded({box("lower", Vec3::Constant(0.5), RigidKind::dynamic, at(0, 0.25, 0)),
                                     box("upper", Vec3::Constant(0.5), RigidKind::dynamic, at(0, 0.75, 0)),
                                     barrel("barrel", {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())), Vec3(3, 0.34, 0)})});
  for (const double side : {-1.0, 1.0}) {  // it would roll for ever
    scene.bodies.push_back(box("wall " + std::to_string(side), Vec3(1, 0.4, 0.1), RigidKind::fixed, at(3, 0.2, 0.4 * side)));
  }
  std::get<ExampleModel>(scene.bodies[2].model).parameters.beta = 8;  // its weight, 3.3 N s a step, does not dent it
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world));
  const Pose upper = world->pose(1);
  for (int k = 0; k < 100; ++k) world->step();
  EXPECT_EQ(world->pose(1).p_WB, upper.p_WB);
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(125, 0, 0), .point = world->pose(0).p_WB}));  // 1 m/s
  world->step();
  EXPECT_EQ(world->workload().live_bodies, 2);
  EXPECT_TRUE(world->is_asleep(2));
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 2, .impulse = Vec3(0, -60, 0), .point = Vec3(3, 0.66, 0)}));
  EXPECT_GE(world->step().plastic_impulses, 1);
  EXPECT_EQ(asleep(*world), 0);
  EXPECT_TRUE(rest(*world, 30));
}

// What wakes in the rigid room starts without warm impulses of its contacts. (Eight boxes sway ever more, asleep or not: the
// rigid solver's ten iterations.)
TEST(WorldSleep, ARigidStackStandsAfterWaking) {
  std::vector<BodyDescription> bodies;
  for (int k = 0; k < 4; ++k) bodies.push_back(box("box " + std::to_string(k), Vec3::Constant(0.5), RigidKind::dynamic, at(0, 0.25 + 0.5 * k, 0)));
  bodies.push_back(ball("pebble", 0.05, 0.1, at(0, 30, 0)));
  auto world = make_world(grounded(std::move(bodies)));
  while (world->workload().live_bodies > 1 && world->time() < 3) world->step();  // all but the pebble, which falls
  const bool slept_first = asleep(*world) == 4;
  const double top = world->pose(3).p_WB.y();
  double fastest = 0;
  for (int k = 0; k < 120; ++k) {
    world->step();
    for (BodyId b = 0; b < 4; ++b) fastest = std::max(fastest, world->velocity(b).norm());
  }
  EXPECT_TRUE(slept_first);
  EXPECT_LT(fastest, 9.81 / 60);  // one step of free fall
  EXPECT_NEAR(world->pose(3).p_WB.y(), top, 1e-3);
}

TEST(WorldSleep, WhatStartsAsleepHangsUntilItIsStruck) {
  SceneDescription scene = grounded({cube("hangs", at(0, 2, 0)), cube("on it", at(0.1, 2 + kEdge, 0)),
                                     box("rigid", Vec3::Constant(0.3), RigidKind::dynamic, at(0.25, 2.152 + 2 * kEdge, 0.25)),
                                     cube("falls", at(0.1, 4, 0.1))});
  for (int b = 0; b < 3; ++b) scene.bodies[b].asleep = true;
  auto world = make_world(scene);
  EXPECT_EQ(world->workload().asleep_bodies, 3);
  const std::vector<Vec3> x = world->fem(0).x;
  for (int k = 0; k < 10; ++k) world->step();
  EXPECT_EQ(world->fem(0).x, x);
  EXPECT_EQ(world->fem(0).von_mises[0], 0);
  EXPECT_EQ(asleep(*world), 3);
  for (int k = 0; k < 240; ++k) world->step();
  EXPECT_LT(lowest(*world, 0), 0.05);
  EXPECT_LT(world->pose(2).p_WB.y(), 2);
}

TEST(WorldSleep, AScriptedBodyThatComesNearWakesASleeper) {
  for (const bool soft_mover : {false, true}) {
    SceneDescription scene = grounded({cube("sleeper", at(0, 0, 0))});
    const Pose from = at(-3, 0.05, 0), to = at(0.2, 0.05, 0);
    if (soft_mover) {
      BodyDescription mover = soft_block("mover", {1, 1, 1}, kEdge, from);
      NodeMotion all;
      for (int n = 0; n < 8; ++n) all.nodes.push_back(n);
      all.keys = {{3, Pose{}}, {6, at(3.2, 0, 0)}};
      std::get<FemModel>(mover.model).motions = {all};
      scene.bodies.push_back(mover);
    } else {
      BodyDescription mover = box("mover", Vec3::Constant(kEdge), RigidKind::kinematic, at(-3 + kEdge / 2, 0.3, kEdge / 2));
      std::get<RigidModel>(mover.model).motion = {{3, mover.pose}, {6, at(0.2 + kEdge / 2, 0.3, kEdge / 2)}};
      scene.bodies.push_back(mover);
    }
    auto world = make_world(scene);
    EXPECT_EQ(world->workload().live_bodies, 1);  // who is scripted is neither
    ASSERT_TRUE(rest(*world, 3));
    while (world->time() < 6.1) world->step();
    EXPECT_GT(world->pose(0).p_WB.x(), 0.2 + kEdge) << soft_mover;  // pushed out of the way
    EXPECT_TRUE(rest(*world)) << soft_mover;
  }
}

TEST(WorldSleep, OwnNodesThatAScriptMovesWakeABody) {
  BodyDescription beam = soft_block("beam", {4, 1, 1}, 0.25, at(0, 1, 0), Vec3::Zero(), 1e7);
  auto& model = std::get<FemModel>(beam.model);
  model.material.damping_stiffness = 0.01;
  NodeMotion held = end_of(model);
  held.keys = {{5, Pose{}}, {6, at(0, 0.001, 0)}};  // 1 mm/s
  model.motions.push_back(held);
  SceneDescription scene;
  scene.bodies = {beam};
  auto world = make_world(scene);
  ASSERT_TRUE(rest(*world, 5));
  const double from = world->pose(0).p_WB.y();
  while (world->time() < 8) world->step();
  EXPECT_NEAR(world->pose(0).p_WB.y(), from + 0.001, 2e-4);
  EXPECT_EQ(asleep(*world), 1);
}

TEST(WorldSleep, BitsDoNotDependOnThreadsThroughSleepAndWaking) {
  SceneDescription scene = stack(3);
  scene.bodies.insert(scene.bodies.begin() + 3, box("box", Vec3(0.4, 0.3, 0.4), RigidKind::dynamic, at(3, 0.15, 0)));
  scene.bodies.insert(scene.bodies.begin() + 4, cube("apart", at(-3, 0, 0)));
  scene.script = {{4, ApplyImpulse{.body = 0, .impulse = Vec3(0.3 * kMass, 0, 0), .point = Vec3(0, 0.25, 0.25)}},
                  {4.5, ApplyImpulse{.body = 3, .impulse = Vec3(0, 100, 0), .point = Vec3(3, 0.15, 0)}}};
  auto one = make_world(scene, 1), two = make_world(scene, 2);
  bool slept = false, woke = false;
  for (int k = 0; k < 480; ++k) {
    one->step();
    two->step();
    ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
    slept = slept || asleep(*one) == 5;
    woke = woke || (slept && asleep(*one) < 3);
  }
  EXPECT_TRUE(slept);
  EXPECT_TRUE(woke);
}

TEST(WorldSleep, TheHashKnowsWhoSleeps) {
  SceneDescription scene = empty_space({cube("cube", at(0, 0, 0))});
  const std::uint64_t live = make_world(scene)->state_hash();
  scene.bodies[0].asleep = true;
  EXPECT_NE(make_world(scene)->state_hash(), live);
}

}  // namespace
}  // namespace crumple::sim
