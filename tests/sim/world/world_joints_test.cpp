#include "tests/sim/world/world_bodies.h"

// Prescored fracture (Jones et al. 2016, section 5): joints between bodies that give way.
namespace crumple::sim {
namespace {

BodyDescription box(const std::string& name, const Vec3& half_extents, double mass, const Pose& pose,
                    RigidKind kind = RigidKind::dynamic) {
  RigidModel model{.kind = kind, .mass = mass};
  model.shapes.push_back({Pose{}, Box{half_extents}});
  return {.name = name, .pose = pose, .model = model};
}

// `count` boxes of 10 kg hang below one beam, each by a joint that bears `strength`.
SceneDescription hanging(int count, double strength) {
  SceneDescription scene;
  scene.bodies.push_back(box("beam", {100, 0.1, 0.1}, 0, at(0, 0, 0), RigidKind::fixed));
  for (int k = 0; k < count; ++k) {
    scene.bodies.push_back(box("box " + std::to_string(k), {0.1, 0.1, 0.1}, 10, at(k - count / 2.0, -0.2, 0)));
    scene.joints.push_back({static_cast<BodyId>(k + 1), 0, Vec3(k - count / 2.0, -0.1, 0), strength});
  }
  return scene;
}

int parted(const std::vector<Event>& events) {
  return static_cast<int>(std::ranges::count(events, EventKind::parted, &Event::kind));
}

TEST(WorldJoints, HoldUpToTheirStrengthAndPartAboveIt) {
  for (const double share : {1.01, 0.99}) {
    auto world = make_world(hanging(1, share * 10 * 9.81));
    for (int k = 0; k < 240; ++k) world->step();
    const auto events = world->take_events();
    ASSERT_EQ(parted(events), share < 1 ? 1 : 0);
    EXPECT_EQ(world->pose(1).p_WB.y() < -1, share < 1);
    for (const Event& event : events) {
      if (event.kind != EventKind::parted) continue;
      EXPECT_NEAR(event.magnitude, 98.1, 1e-6);
      EXPECT_LT((event.point - Vec3(-0.5, -0.1, 0)).norm(), 1e-6);
      EXPECT_EQ(event.body, 1u);
    }
  }
}

// m g l / 2 = 20 * 9.81 * 0.5 N m at the root of a shelf.
TEST(WorldJoints, BearBendingByItsOwnLimit) {
  for (const double share : {1.01, 0.99}) {
    SceneDescription scene;
    scene.bodies = {box("wall", {0.1, 1, 1}, 0, at(-0.1, 0, 0), RigidKind::fixed), box("shelf", {0.5, 0.05, 0.05}, 20, at(0.5, 0, 0))};
    scene.joints = {{1, 0, Vec3::Zero(), 1e9, share * 98.1}};
    auto world = make_world(scene);
    for (int k = 0; k < 120; ++k) world->step();
    EXPECT_EQ(parted(world->take_events()), share < 1 ? 1 : 0);
  }
}

TEST(WorldJoints, AStormOfBreaksIsSpreadOverSteps) {
  SceneDescription scene = hanging(100, 1);
  scene.max_breaks_per_step = 32;
  std::uint64_t hash = 0;
  for (int threads : {1, 2}) {
    auto world = make_world(scene, threads);
    std::vector<int> broken;
    for (int k = 0; k < 5; ++k) broken.push_back(world->step().broken_joints);
    EXPECT_EQ(broken, (std::vector<int>{32, 32, 32, 4, 0}));
    EXPECT_EQ(parted(world->take_events()), 100);
    for (int k = 0; k < 60; ++k) world->step();
    for (BodyId b = 1; b <= 100; ++b) ASSERT_LT(world->pose(b).p_WB.y(), -1);
    if (threads == 1) hash = world->state_hash();
    else EXPECT_EQ(world->state_hash(), hash);
  }
}

// Six boxes of 10 kg in a row, joined, are struck at one end by a ball of 10 kg. What is given to them passes along the row:
// joint k of five bears (6 - k) / 6 of it.
std::vector<double> parted_at(double dt, double joint_time, double gap, double speed, double strength) {
  SceneDescription scene = empty_space({});
  scene.dt = dt;
  scene.joint_time = joint_time;
  for (int k = 0; k < 6; ++k) scene.bodies.push_back(box("box " + std::to_string(k), {0.1, 0.1, 0.1}, 10, at(0.2 * k, 0, 0)));
  for (BodyId k = 0; k < 5; ++k) scene.joints.push_back({k, k + 1, Vec3(0.2 * k + 0.1, 0, 0), strength});
  scene.bodies.push_back(ball("ball", 0.1, 10, at(-0.2 - gap, 0, 0), Vec3(speed, 0, 0)));
  auto world = make_world(scene);
  for (int k = 0; k * dt < 0.4; ++k) world->step();
  std::vector<double> places;
  for (const Event& event : world->take_events())
    if (event.kind == EventKind::parted) places.push_back(event.point.x());
  return places;
}

TEST(WorldJoints, TheSameBlowBreaksTheSameJointsAtEveryStep) {
  std::vector<std::size_t> raw;
  for (const double speed : {4.0, 8.0, 12.0, 20.0}) {
    std::vector<std::size_t> counts;
    for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480})
      for (const double gap : {0.5, 0.53, 0.57}) counts.push_back(parted_at(dt, 1.0 / 60, gap, speed, 2200).size());
    std::printf("ball at %.0f m/s: joints that part at dt = 1/60, 1/120, 1/240, 1/480, three gaps each:", speed);
    for (const std::size_t count : counts) std::printf(" %zu", count);
    std::printf("\n");
    EXPECT_EQ(counts, std::vector<std::size_t>(counts.size(), counts[0])) << speed;
  }
  for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480}) raw.push_back(parted_at(dt, 0, 0.5, 8, 2200).size());
  std::printf("by each step's own force, 8 m/s: %zu %zu %zu %zu\n", raw[0], raw[1], raw[2], raw[3]);
  EXPECT_LT(raw.front(), raw.back()) << "or there would be nothing to take care of";
}

TEST(WorldJoints, PartsDentByExampleOnTheirOwnAndPart) {
  SceneDescription scene = empty_space({barrel("lower", at(0, 0, 0)), barrel("upper", at(0, 0.9, 0)),
                                        ball("ball", 0.2, 20, at(-2, 0, 0), Vec3(15, 0, 0))});
  scene.dt = 0.004;
  scene.joints = {{0, 1, Vec3(0, 0.45, 0), 450}};
  auto world = make_world(scene);
  int dents[2]{}, parts = 0;
  for (int k = 0; k < 250; ++k) {
    world->step();
    for (const Event& event : world->take_events()) {
      if (event.kind == EventKind::dent && event.body < 2) ++dents[event.body];
      parts += event.kind == EventKind::parted;
    }
  }
  EXPECT_GT(dents[0], 0);
  EXPECT_EQ(dents[1], 0);
  EXPECT_EQ(parts, 1);
  // What struck and what flies has all of the momentum.
  EXPECT_LT((world->energies().momentum - Vec3(300, 0, 0)).norm(), 1e-6);
}

TEST(WorldJoints, WhatIsJoinedSleepsAndWakesTogether) {
  SceneDescription scene;
  scene.dt = 1.0 / 120;
  scene.bodies = {ground(), box("post", {0.1, 0.5, 0.1}, 10, at(0, 0.5, 0)), box("arm", {0.5, 0.1, 0.1}, 1, at(0.3, 1.1, 0)),
                  ball("ball", 0.1, 1, at(0.7, 40, 0))};
  scene.joints = {{1, 2, Vec3(0, 1, 0)}};
  auto world = make_world(scene);
  bool slept = false;
  for (int k = 0; k < 320; ++k) {
    world->step();
    EXPECT_EQ(world->is_asleep(1), world->is_asleep(2));
    slept |= world->is_asleep(1);
  }
  ASSERT_TRUE(slept);
  for (int k = 0; k < 40; ++k) world->step();  // the ball lands on the arm
  EXPECT_FALSE(world->is_asleep(1));
  EXPECT_EQ(parted(world->take_events()), 0);
}

}  // namespace
}  // namespace crumple::sim
