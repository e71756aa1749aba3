#include "server/runtime/world_runner.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "common/stream_decoder.h"
#include "tests/runtime/awaited.h"
#include "tests/runtime/fake_clock.h"
#include "tests/runtime/small_scene.h"
#include "tests/support/tearing_bars.h"

namespace crumple::runtime {
namespace {

using test::await;

std::unique_ptr<WorldRunner> start(const RunnerOptions& options = {},
                                   WorldRunner::MakeScene make = [] { return test::falling_box(); }) {
  std::unique_ptr<WorldRunner> runner;
  const auto created = await<WorldId>([&](auto done) { runner = std::make_unique<WorldRunner>(1, "", make, options, done); });
  EXPECT_TRUE(created) << created.error().text();
  return runner;
}

Result<StepSummary> step(WorldRunner& runner, std::uint32_t steps) {
  return await<StepSummary>([&](auto done) { runner.step(steps, true, done); });
}

WorldRunner::MakeCommand push_box(double impulse) {
  return [=](const sim::World& world) -> Result<sim::Command> {
    return sim::ApplyImpulse{world.find("box"), Vec3(impulse, 0, 0), Vec3(0, 2, 0)};
  };
}

TEST(WorldRunner, StepsLikeAWorldOfItsOwn) {
  const auto runner = start();
  const auto world = *sim::World::create(test::falling_box());
  const auto submitted = await<std::uint64_t>([&](auto done) { runner->submit(push_box(300), done); });
  ASSERT_TRUE(submitted);
  EXPECT_EQ(*submitted, 1u);
  ASSERT_TRUE(world->submit(*push_box(300)(*world)));
  const auto summary = step(*runner, 40);
  for (int i = 0; i < 40; ++i) world->step();
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->state_hash, world->state_hash());
  EXPECT_EQ(summary->steps, 40u);
  EXPECT_EQ(summary->step, 40u);
  EXPECT_DOUBLE_EQ(summary->time, world->time());
}

TEST(WorldRunner, RefusesWhatTheWorldRefusesAndNothingChanges) {
  const auto runner = start();
  const auto before = await<WorldInfo>([&](auto done) { runner->info(false, true, done); });
  const auto refused = await<std::uint64_t>([&](auto done) { runner->submit(push_box(std::nan("")), done); });
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
  const auto after = await<WorldInfo>([&](auto done) { runner->info(true, true, done); });
  EXPECT_EQ(before->state_hash, after->state_hash);
  EXPECT_EQ(after->bodies.at(1).name, "box");
}

TEST(WorldRunner, StepsOnlyWhenPausedAndWithinLimits) {
  const auto runner = start();
  EXPECT_EQ(step(*runner, 0).error().field, "steps");
  EXPECT_EQ(step(*runner, WorldRunner::kMaxSteps + 1).error().field, "steps");
  ASSERT_TRUE(await<void>([&](auto done) { runner->play(1, done); }));
  EXPECT_EQ(step(*runner, 1).error().code, ErrorCode::failed_precondition);
  ASSERT_TRUE(await<std::uint64_t>([&](auto done) { runner->pause(done); }));
  EXPECT_TRUE(step(*runner, 1));
  EXPECT_EQ(await<void>([&](auto done) { runner->play(std::nan(""), done); }).error().field, "speed");
}

TEST(WorldRunner, PauseEndsTheStepsOrderedBeforeIt) {
  const auto runner = start();
  test::Pending<StepSummary> first, second;
  runner->step(WorldRunner::kMaxSteps, false, first.done());
  runner->step(WorldRunner::kMaxSteps, false, second.done());
  const auto paused = await<std::uint64_t>([&](auto done) { runner->pause(done); });
  const Result<StepSummary> a = first.get(), b = second.get();
  ASSERT_TRUE(a && b && paused);
  EXPECT_LT(a->steps, WorldRunner::kMaxSteps);
  EXPECT_EQ(b->steps, 0u);
  EXPECT_EQ(*paused, a->steps);
}

TEST(WorldRunner, InfoIsServedWhileAStepRuns) {
  const auto runner = start();
  test::Pending<StepSummary> stepped;
  runner->step(WorldRunner::kMaxSteps, false, stepped.done());
  const auto info = await<WorldInfo>([&](auto done) { runner->info(true, true, done); });
  ASSERT_TRUE(info);
  EXPECT_LT(info->status.step, WorldRunner::kMaxSteps);
  runner->pause([](auto) {});
  stepped.get();
}

TEST(WorldRunner, KeepsPaceWithTheWallClock) {
  const auto clock = std::make_shared<test::FakeClock>();
  const auto runner = start({.clock = clock});
  test::BellReader reader(runner->hub(), {.credits = 1});
  ASSERT_TRUE(await<void>([&](auto done) { runner->play(1, done); }));
  std::uint64_t step = 0;
  while (step < 200) {
    const auto frame = reader.next_of<FrameDelivery>();
    ASSERT_TRUE(frame);
    step = frame->frame->frame().step;
    reader.reader->grant(1);
  }
  ASSERT_TRUE(await<std::uint64_t>([&](auto done) { runner->pause(done); }));
  const WorldStatus status = runner->status();
  EXPECT_NEAR(status.time, clock->now(), 2 * status.dt);  // neither runs away from the other
  EXPECT_EQ(status.dropped_seconds, 0);
}

TEST(WorldRunner, AWorldTooSlowForItsClockRunsSlowerAndDropsTheRest) {
  const auto clock = std::make_shared<test::FakeClock>(0.02);  // each look at the clock costs 20 ms: a step, two looks
  const auto runner = start({.max_owed = 0.1, .clock = clock});
  test::BellReader reader(runner->hub(), {.credits = 1});
  ASSERT_TRUE(await<void>([&](auto done) { runner->play(1, done); }));
  double factor = 1;
  for (std::uint64_t step = 0; step < 100;) {
    const auto frame = reader.next_of<FrameDelivery>();
    ASSERT_TRUE(frame);
    step = frame->frame->frame().step;
    factor = frame->frame->frame().real_time_factor;
    reader.reader->grant(1);
  }
  const WorldStatus status = runner->status();
  EXPECT_GT(factor, 0);
  EXPECT_LT(factor, status.dt / 0.04);
  EXPECT_GT(status.dropped_seconds, 1);  // of more than 4 s that 100 steps took, 0.83 s were simulated
}

TEST(WorldRunner, AThrowFailsThisWorldAlone) {
  const auto broken = start(), other = start();
  test::BellReader reader(broken->hub(), {});
  const auto thrown = await<std::uint64_t>([&](auto done) {
    broken->submit([](const sim::World&) -> Result<sim::Command> { throw std::runtime_error("a library's words"); }, done);
  });
  ASSERT_FALSE(thrown);
  EXPECT_EQ(thrown.error().code, ErrorCode::internal);
  const auto closed = reader.next_of<Closed>();
  ASSERT_TRUE(closed);
  EXPECT_NE(closed->reason.message.find("a library's words"), std::string::npos);
  EXPECT_EQ(step(*broken, 1).error().code, ErrorCode::internal);
  EXPECT_EQ(broken->status().state, WorldState::failed);
  EXPECT_EQ(await<WorldInfo>([&](auto done) { broken->info(true, true, done); })->status.failure, "a library's words");
  EXPECT_TRUE(step(*other, 3));
}

TEST(WorldRunner, AThrowWhileMakingTheSceneIsAnError) {
  std::unique_ptr<WorldRunner> runner;
  const auto created = await<WorldId>([&](auto done) {
    const auto make = []() -> Result<sim::SceneDescription> { throw std::runtime_error("no"); };
    runner = std::make_unique<WorldRunner>(1, "", make, RunnerOptions(), done);
  });
  ASSERT_FALSE(created);
  EXPECT_EQ(created.error().code, ErrorCode::internal);
}

TEST(WorldRunner, ScriptsActAtTheirTimeFromNow) {
  const auto runner = start();
  ASSERT_TRUE(step(*runner, 10));
  const auto script = [](const sim::World& world) -> Result<std::vector<sim::ScriptedCommand>> {
    const sim::Command command = sim::ApplyImpulse{world.find("box"), Vec3(300, 0, 0), Vec3(0, 2, 0)};
    return std::vector<sim::ScriptedCommand>{{5 * world.dt(), command}};
  };
  ASSERT_TRUE(await<double>([&](auto done) { runner->schedule(script, /*absolute=*/false, done); }));
  test::BellReader reader(runner->hub(), {});
  ASSERT_TRUE(step(*runner, 10));
  const auto event = reader.next_of<SharedEvent>();
  ASSERT_TRUE(event);
  EXPECT_EQ((*event)->kind, sim::EventKind::script);
  EXPECT_NEAR((*event)->time, 15 * runner->status().dt, 1.5 * runner->status().dt);
}

TEST(WorldRunner, APausedWorldShowsItself) {
  const auto runner = start();
  test::BellReader reader(runner->hub(), {.credits = 1});
  const auto topology = reader.next_of<TopologyDelivery>();
  ASSERT_TRUE(topology);
  const auto frame = reader.next_of<FrameDelivery>();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->frame->frame().step, 0u);
  EXPECT_EQ(decode_topology_part(*topology->payload)->bodies.size(), 2u);
}

// A reader's deliveries decoded: frames in the order of their coming, and what came of topologies.
struct Follower {
  test::BellReader reader;
  StreamDecoder decoder;
  std::vector<TopologyDelivery> topologies;

  // The next frame as decoded; nothing if none comes.
  std::optional<Frame> next_frame() {
    while (const auto delivery = reader.next()) {
      if (const auto* topology = std::get_if<TopologyDelivery>(&*delivery)) {
        topologies.push_back(*topology);
        const auto whole = decoder.take_topology(*topology->payload);
        EXPECT_TRUE(whole) << whole.error().text();
      } else if (const auto* frame = std::get_if<FrameDelivery>(&*delivery)) {
        auto decoded = decoder.decode_frame(*frame->payload);
        EXPECT_TRUE(decoded) << decoded.error().text();
        if (decoded) return *std::move(decoded);
        return {};
      }
    }
    return {};
  }
};

// Readers that skip at random see, of a world in which twelve bodies break, the positions of its own frame at that step, on its topology.
TEST(WorldRunner, ReadersThatSkipAtRandomSeeTheWorldsOwnVertices) {
  const auto scene = [] { return test::tearing_bars(12, 0.02); };
  const auto runner = start({}, scene);
  const auto world = *sim::World::create(scene());
  std::vector<std::unique_ptr<Follower>> followers;
  for (const Codec codec : {Codec::float32, Codec::quantised16})
    for (const bool compress : {false, true})
      followers.push_back(std::make_unique<Follower>(test::BellReader(runner->hub(), {.format = {codec, compress, false}})));
  std::mt19937 random(7);
  std::vector<int> skipped(followers.size(), 0);
  struct Seen {
    Topology topology;
    Frame frame;
  };
  std::vector<Seen> history{{world->topology(), world->capture()}};  // by step
  for (int round = 0; round < 60; ++round) {
    const std::uint32_t steps = 1 + random() % 2;
    const std::uint32_t epoch = world->topology().epoch;
    ASSERT_TRUE(step(*runner, steps));
    for (std::uint32_t k = 0; k < steps; ++k) {
      world->step();
      history.push_back({world->topology(), world->capture()});
    }
    for (std::size_t f = 0; f < followers.size(); ++f) {
      if (random() % 3 != 0 && round < 59) {
        skipped[f] += world->topology().epoch > epoch;
        continue;
      }
      Follower& follower = *followers[f];
      follower.reader.reader->grant(1);
      const auto seen = follower.next_frame();
      ASSERT_TRUE(seen);
      const auto& [topology, here] = history.at(seen->step);  // of the last step, or of one before that another reader asked for
      EXPECT_EQ(follower.decoder.topology().epoch, topology.epoch);
      for (const BodyTopology& body : topology.bodies) {
        const BodyTopology& drawn = follower.decoder.topology().bodies[body.id];
        EXPECT_EQ(drawn.epoch, body.epoch);
        EXPECT_EQ(drawn.triangles, body.triangles);
        const auto &x = here.bodies[body.id].positions, &got = seen->bodies[body.id].positions;
        ASSERT_EQ(got.size(), x.size());
        for (std::size_t v = 0; v < x.size(); ++v) EXPECT_LT((got[v] - x[v]).norm(), 5e-5f);  // a step of a box of 2 m
      }
    }
  }
  EXPECT_GT(world->topology().epoch, 5u) << "the bars must break for this test to say anything";
  for (std::size_t f = 0; f < followers.size(); ++f) {
    EXPECT_GT(skipped[f], 0);
    const auto& topologies = followers[f]->topologies;
    EXPECT_LT(topologies.size(), world->topology().epoch + 1u);
    for (std::size_t k = 0; k < topologies.size(); ++k) EXPECT_EQ(topologies[k].base.has_value(), k > 0);
  }
}

TEST(WorldRunner, ABreakBesideALargeBodyCostsThatOfTheSmallOne) {
  const auto runner = start({}, [] { return test::tearing_bars(1, 0, /*with_block=*/true); });
  Follower follower{test::BellReader(runner->hub(), {.credits = 1})};
  ASSERT_TRUE(follower.next_frame());
  while (follower.topologies.size() < 2) {
    ASSERT_TRUE(step(*runner, 1));
    follower.reader.reader->grant(1);
    ASSERT_TRUE(follower.next_frame());
  }
  const auto& bodies = follower.decoder.topology().bodies;
  const std::size_t bar = 12 * (bodies[0].vertices.size() + bodies[0].triangles.size());
  EXPECT_LT(follower.topologies[1].payload->size(), bar + 150);  // header, name, colour
  EXPECT_GT(follower.topologies[0].payload->size(), 3 * bar);
}

TEST(WorldRunner, AWorldThatOutgrowsAMessageGoesOnInParts) {
  const auto scene = [] { return test::tearing_bars(4, 0); };
  const auto world = *sim::World::create(scene());
  std::size_t limit = 0;  // as it begins it is one message
  for (const BodyTopology& body : world->topology().bodies) limit += 12 * (body.vertices.size() + body.triangles.size()) + 200;
  const auto runner = start({.max_content = limit}, scene);
  Follower follower{test::BellReader(runner->hub(), {.credits = 1})};
  ASSERT_TRUE(follower.next_frame());
  ASSERT_EQ(follower.topologies.size(), 1u);
  for (int k = 0; k < 30; ++k) {
    ASSERT_TRUE(step(*runner, 1));
    follower.reader.reader->grant(1);
    ASSERT_TRUE(follower.next_frame());
  }
  ASSERT_GT(follower.topologies.size(), 1u);
  Follower late{test::BellReader(runner->hub(), {.credits = 1})};
  ASSERT_TRUE(late.next_frame());
  EXPECT_GT(late.topologies.size(), 1u);
  EXPECT_EQ(late.topologies.size(), late.topologies[0].parts);
  EXPECT_EQ(late.decoder.topology().bodies.size(), 5u);
}

TEST(WorldRunner, AFrameThatOutgrowsAMessageEndsTheStreamWithTheReason) {
  const auto runner = start({.max_content = 500}, [] { return test::tearing_bars(1); });
  test::BellReader reader(runner->hub(), {.credits = 1});
  const auto closed = reader.next_of<Closed>();
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->reason.code, ErrorCode::resource_exhausted);
  EXPECT_NE(closed->reason.message.find("bar 0"), std::string::npos) << closed->reason.message;
}

TEST(WorldRunner, EndingRefusesWaitingOrdersAtOnce) {
  auto runner = start();
  test::Pending<StepSummary> stepped;
  runner->step(WorldRunner::kMaxSteps, false, stepped.done());
  runner->end({ErrorCode::not_found, "", "world 1 was deleted"});
  const auto result = stepped.get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "world 1 was deleted");
}

}  // namespace
}  // namespace crumple::runtime
