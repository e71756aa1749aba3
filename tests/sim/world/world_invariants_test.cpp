// Momentum, energy and work that a world reports of a step.
#include "tests/sim/world/world_bodies.h"

#include <cmath>

namespace crumple::sim {
namespace {

std::unique_ptr<World> watched(const SceneDescription& scene) {
  auto world = World::create(scene, {.invariants = true});
  EXPECT_TRUE(world) << world.error().text();
  return world ? std::move(*world) : nullptr;
}

double total(const Invariants& i) { return i.energies.kinetic + i.energies.elastic + i.energies.gravitational; }

// m v^2 / 2 goes to e^2 of it in the step that bounces; in the air nothing works.
TEST(WorldInvariants, ABouncingBallLosesWhatItsRestitutionSays) {
  SceneDescription scene;
  BodyDescription floor = ground();
  std::get<RigidModel>(floor.model).restitution = 1;
  BodyDescription bouncer = ball("ball", 0.2, 3, at(0, 1, 0));
  std::get<RigidModel>(bouncer.model).restitution = 0.5;
  scene.bodies = {floor, bouncer};
  scene.gravity = Vec3::Zero();
  scene.bodies[1].velocity = Vec3(0, -4, 0);
  auto world = watched(scene);
  double contact = 0;
  for (int k = 0; k < 60; ++k) {
    const double before = total(world->invariants());
    world->step();
    const Invariants now = world->invariants();
    EXPECT_NEAR(total(now) - before, now.contact_work, 1e-9);
    if (world->velocity(1).y() < -3.9) EXPECT_NEAR(now.contact_work, 0, 1e-12);
    contact += now.contact_work;
    EXPECT_EQ(now.command_work, 0);
    EXPECT_EQ(now.prescribed_work, 0);
  }
  EXPECT_NEAR(contact, -0.75 * 0.5 * 3 * 16, 1e-6);
}

TEST(WorldInvariants, FreeFallNeedsNoWork) {
  SceneDescription scene;
  scene.bodies = {ball("ball", 0.2, 3, at(0, 1, 0)), soft_block("block", {2, 2, 2}, 0.25, at(3, 0, 0))};
  auto world = watched(scene);
  for (int k = 0; k < 30; ++k) {
    world->step();
    EXPECT_NEAR(world->invariants().contact_work, 0, 1e-9);  // of 60 J
  }
  EXPECT_NEAR(world->invariants().energies.momentum.y(), -(3 + 125) * 9.81 * 30 / 120, 1e-9);
}

// j (v + j / 2m) of an impulse through the centre.
TEST(WorldInvariants, AnImpulseWorksAtTheMeanOfTheVelocitiesBeforeAndAfter) {
  auto world = watched(empty_space({ball("ball", 0.2, 3, at(0, 0, 0), Vec3(2, 0, 0)),
                                    soft_block("block", {1, 1, 1}, 0.2, at(3, 0, 0), Vec3(2, 0, 0), 1e8)}));
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(6, 0, 0), .point = Vec3(0, 0, 0)}));
  world->step();
  EXPECT_NEAR(world->invariants().command_work, 6 * (2 + 1), 1e-12);
  std::vector<int> all;
  for (int n = 0; n < static_cast<int>(world->fem(1).x.size()); ++n) all.push_back(n);
  ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = 1, .nodes = all, .impulse = Vec3(8, 0, 0)}));
  world->step();
  EXPECT_NEAR(world->invariants().command_work, 8 * (2 + 0.5), 1e-9);  // 8 kg
  world->step();
  EXPECT_EQ(world->invariants().command_work, 0);
}

// Everything at once, in steps so small that the integrator takes next to nothing: energy changes by the work.
TEST(WorldInvariants, EnergyChangesByTheWorkDone) {
  BodyDescription beam = soft_block("beam", {6, 2, 2}, 0.2, at(0, 0, 0), Vec3::Zero(), 1e5);
  auto& model = std::get<FemModel>(beam.model);
  NodeMotion driven = end_of(model);
  for (int k = 0; k <= 40; ++k) {
    const double t = 0.02 * k;
    driven.keys.push_back({t, {Quat::Identity(), Vec3(0, 0.1 * (1 - std::cos(4 * t)), 0)}});
  }
  model.motions.push_back(driven);
  for (const Integrator integrator : {Integrator::backward_euler, Integrator::bdf2}) {
    SceneDescription scene;
    scene.dt = 1.0 / 4000;
    scene.integrator = integrator;
    scene.bodies = {beam, soft_block("pushed", {2, 2, 2}, 0.2, at(0, 3, 0)),
                    ball("ball", 0.15, 20, at(1, 0.75, 0.2), Vec3(0, -2, 0))};
    auto world = watched(scene);
    ASSERT_TRUE(world->submit(ApplyForce{.body = 1, .force = Vec3(200, 0, 0), .point = Vec3(0.2, 3.2, 0.2), .duration = 0.3}));
    const double start = total(world->invariants());
    double contact = 0, command = 0, prescribed = 0, size = 0;
    for (int k = 0; k < 1600; ++k) {
      world->step();
      const Invariants now = world->invariants();
      contact += now.contact_work;
      command += now.command_work;
      prescribed += now.prescribed_work;
      size += std::abs(now.contact_work) + std::abs(now.command_work) + std::abs(now.prescribed_work);
    }
    EXPECT_GT(command, 1);
    EXPECT_GT(std::abs(prescribed), 1);
    EXPECT_LT(contact, -1);
    EXPECT_NEAR(total(world->invariants()) - start, contact + command + prescribed, 0.03 * size);
  }
}

TEST(WorldInvariants, AskingDoesNotChangeTheState) {
  SceneDescription scene;
  scene.bodies = {ground(), soft_block("block", {2, 2, 2}, 0.25, at(0, 0.1, 0)), ball("ball", 0.2, 20, at(0.2, 1, 0.2))};
  auto with = watched(scene), without = make_world(scene);
  double work = 0;
  for (int k = 0; k < 60; ++k) {
    with->step();
    without->step();
    work += std::abs(with->invariants().contact_work);
    EXPECT_EQ(without->invariants().contact_work, 0);
  }
  EXPECT_GT(work, 1);
  EXPECT_EQ(with->state_hash(), without->state_hash());
  EXPECT_EQ(with->invariants().energies.kinetic, without->invariants().energies.kinetic);
}

}  // namespace
}  // namespace crumple::sim
