// What clients and scripts may do to a running world.
#include "tests/sim/world/world_bodies.h"

#include <cmath>

namespace crumple::sim {
namespace {

constexpr double kBlockMass = 1000 * 0.125, kBarrelMass = 20, kBallMass = 2;
enum : BodyId { kBlock, kBarrel, kBall, kGround, kLift };

// One of each, out of reach of each other.
SceneDescription one_of_each() {
  BodyDescription lift = ball("lift", 0.2, 1, at(30, 0, 0));
  std::get<RigidModel>(lift.model).kind = RigidKind::kinematic;
  BodyDescription ground_far = ground();
  ground_far.pose = at(0, -50, 0);
  return empty_space({soft_block("block", {2, 2, 2}, 0.25, at(0, 0, 0)), barrel("barrel", at(10, 0, 0)),
                      ball("ball", 0.2, kBallMass, at(20, 0, 0)), ground_far, lift});
}

const Vec3 kImpulse(1, 2, -3);
const Vec3 kCentre[] = {Vec3::Constant(0.25), Vec3(10, 0, 0), Vec3(20, 0, 0)};

double mass_of(BodyId body) { return body == kBlock ? kBlockMass : body == kBarrel ? kBarrelMass : kBallMass; }

TEST(WorldCommands, AnImpulseIsTheChangeOfMomentumOfAnyBody) {
  for (BodyId body : {kBlock, kBarrel, kBall}) {
    auto world = make_world(one_of_each());
    ASSERT_TRUE(world->submit(ApplyImpulse{.body = body, .impulse = kImpulse, .point = kCentre[body], .radius = 0.4}));
    EXPECT_EQ(world->energies().momentum, Vec3::Zero()) << "nothing happens before the next step";
    world->step();
    EXPECT_LT((mass_of(body) * world->velocity(body) - kImpulse).norm(), 1e-9) << body;
    EXPECT_LT((world->energies().momentum - kImpulse).norm(), 1e-9) << body;
    world->step();
    EXPECT_LT((world->energies().momentum - kImpulse).norm(), 1e-9) << "once, not again";
  }
}

TEST(WorldCommands, AnImpulseBesideTheCentreTurnsARigidBody) {
  auto world = make_world(one_of_each());
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = kBall, .impulse = Vec3(0, 0, 1), .point = Vec3(20, 0.2, 0)}));
  world->step();
  const double turned = Eigen::AngleAxisd(world->pose(kBall).R_WB).angle();
  // w = r x j / I = 0.2 / (2/5 m r^2)
  EXPECT_NEAR(turned, 0.2 / (0.4 * kBallMass * 0.04) * world->dt(), 1e-6);
}

TEST(WorldCommands, AHardPushDentsABarrel) {
  auto world = make_world(one_of_each());
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = kBarrel, .impulse = Vec3(-0.5, 0, 0), .point = Vec3(10.3, 0, 0)}));
  world->step();
  EXPECT_EQ(world->example_weights(kBarrel).col(0).minCoeff(), 1) << "below beta";
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = kBarrel, .impulse = Vec3(-100, 0, 0), .point = Vec3(10.3, 0, 0)}));
  EXPECT_EQ(world->step().plastic_impulses, 1);
  for (int k = 0; k < 30; ++k) world->step();
  EXPECT_LT(world->example_weights(kBarrel).col(0).minCoeff(), 0.99);
}

TEST(WorldCommands, AnImpulseOnNodesMovesThoseFirstAndTheBodyAsAWhole) {
  auto world = make_world(one_of_each());
  const std::vector<int> nodes{0, 1, 2};
  ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = kBlock, .nodes = nodes, .impulse = kImpulse}));
  world->step();
  EXPECT_LT((world->energies().momentum - kImpulse).norm(), 1e-9);
  const FemView view = world->fem(kBlock);
  EXPECT_GT(view.v[1].norm(), 3 * view.v.back().norm());
}

TEST(WorldCommands, AForceGivesItsMagnitudeTimesItsDuration) {
  const Vec3 force(0, 30, 10);
  for (BodyId body : {kBlock, kBarrel, kBall}) {
    for (double steps : {0.0, 1.0, 5.5}) {
      auto world = make_world(one_of_each());
      const double dt = world->dt(), duration = steps * dt, expected = steps == 0 ? dt : duration;
      ASSERT_TRUE(world->submit(ApplyForce{.body = body, .force = force, .point = kCentre[body], .radius = 0.4, .duration = duration}));
      world->step();
      EXPECT_LT((world->energies().momentum - force * std::min(dt, expected)).norm(), 1e-9);
      for (int k = 0; k < 8; ++k) world->step();
      EXPECT_LT((world->energies().momentum - force * expected).norm(), 1e-9) << body << " over " << steps;
    }
  }
}

TEST(WorldCommands, AScriptActsAtTheFirstStepAtOrAfterItsTime) {
  SceneDescription scene = one_of_each();
  const double dt = scene.dt;
  const ApplyImpulse push{.body = kBall, .impulse = kImpulse, .point = kCentre[kBall]};
  scene.script = {{3 * dt, push}, {4.5 * dt, push}};
  auto world = make_world(scene);
  for (int k = 1; k <= 8; ++k) {
    world->step();
    const int pushes = (k > 3) + (k > 5);  // step k - 1 starts at (k - 1) dt
    EXPECT_LT((world->energies().momentum - pushes * kImpulse).norm(), 1e-9) << k;
  }
  const auto events = world->take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::script);
  EXPECT_EQ(events[0].step, 3u);
  EXPECT_EQ(events[1].step, 5u);
  EXPECT_EQ(events[1].body, kBall);
}

TEST(WorldCommands, AScriptIsAddedWhileTheWorldRuns) {
  auto world = make_world(one_of_each());
  const ApplyImpulse push{.body = kBall, .impulse = kImpulse, .point = kCentre[kBall]};
  world->step();
  world->step();
  ASSERT_TRUE(world->schedule({{5 * world->dt(), push}, {0, push}}));  // the second is past: it acts at once
  for (int k = 3; k <= 8; ++k) {
    world->step();
    EXPECT_LT((world->energies().momentum - (k > 5 ? 2 : 1) * kImpulse).norm(), 1e-9) << k;
  }
}

struct BadCommand {
  const char* what;
  Command command;
  ErrorCode code;
  const char* field;
};

const double kNan = std::nan(""), kInf = std::numeric_limits<double>::infinity();
const BadCommand kBad[] = {
    {"no such body", ApplyImpulse{.body = 5}, ErrorCode::not_found, "body"},
    {"no such body for nodes", ApplyNodeImpulse{.body = 99, .nodes = {0}}, ErrorCode::not_found, "body"},
    {"fixed", ApplyImpulse{.body = kGround, .impulse = kImpulse}, ErrorCode::invalid_argument, "body"},
    {"kinematic", ApplyForce{.body = kLift, .force = kImpulse}, ErrorCode::invalid_argument, "body"},
    {"nan impulse", ApplyImpulse{.body = kBall, .impulse = Vec3(0, kNan, 0)}, ErrorCode::invalid_argument, "impulse.y"},
    {"infinite force", ApplyForce{.body = kBall, .force = Vec3(kInf, 0, 0)}, ErrorCode::invalid_argument, "force.x"},
    {"huge impulse", ApplyImpulse{.body = kBlock, .impulse = Vec3(2e9, 0, 0)}, ErrorCode::invalid_argument, "impulse"},
    {"huge force", ApplyForce{.body = kBlock, .force = Vec3(0, 2e12, 0)}, ErrorCode::invalid_argument, "force"},
    {"nan point", ApplyImpulse{.body = kBlock, .point = Vec3(kNan, 0, 0)}, ErrorCode::invalid_argument, "point.x"},
    {"far point", ApplyForce{.body = kBlock, .point = Vec3(2e6, 0, 0)}, ErrorCode::invalid_argument, "point"},
    {"negative radius", ApplyImpulse{.body = kBlock, .radius = -1}, ErrorCode::invalid_argument, "radius"},
    {"negative duration", ApplyForce{.body = kBlock, .duration = -1}, ErrorCode::invalid_argument, "duration"},
    {"nan duration", ApplyForce{.body = kBlock, .duration = kNan}, ErrorCode::invalid_argument, "duration"},
    {"no nodes", ApplyNodeImpulse{.body = kBlock}, ErrorCode::invalid_argument, "nodes"},
    {"node out of range", ApplyNodeImpulse{.body = kBlock, .nodes = {0, 27}}, ErrorCode::invalid_argument, "nodes[1]"},
    {"negative node", ApplyNodeImpulse{.body = kBlock, .nodes = {-1}}, ErrorCode::invalid_argument, "nodes[0]"},
    {"nodes of a ball", ApplyNodeImpulse{.body = kBall, .nodes = {0}}, ErrorCode::invalid_argument, "body"},
};

TEST(WorldCommands, ABadCommandIsAnErrorAndChangesNothing) {
  auto world = make_world(one_of_each()), untouched = make_world(one_of_each());
  const ApplyImpulse push{.body = kBall, .impulse = kImpulse, .point = kCentre[kBall]};
  for (const BadCommand& bad : kBad) {
    const auto outcome = world->submit(bad.command);
    ASSERT_FALSE(outcome) << bad.what;
    EXPECT_EQ(outcome.error().code, bad.code) << bad.what;
    EXPECT_EQ(outcome.error().field, bad.field) << bad.what << ": " << outcome.error().text();

    // A script is taken as a whole or not at all.
    const auto scheduled = world->schedule({{0, push}, {0, bad.command}});
    ASSERT_FALSE(scheduled) << bad.what;
    EXPECT_EQ(scheduled.error().field, std::string("script[1].") + bad.field) << scheduled.error().text();
  }
  for (double time : {-1.0, kNan, 2e9}) {
    const auto scheduled = world->schedule({{0, push}, {time, push}});
    ASSERT_FALSE(scheduled) << time;
    EXPECT_EQ(scheduled.error().field, "script[1].time");
  }
  for (int k = 0; k < 3; ++k) {
    world->step();
    untouched->step();
  }
  EXPECT_EQ(world->state_hash(), untouched->state_hash());
  EXPECT_EQ(world->energies().momentum, Vec3::Zero());
  EXPECT_TRUE(world->take_events().empty());
}

}  // namespace
}  // namespace crumple::sim
