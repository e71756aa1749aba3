#include "server/runtime/world_runner.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/runtime/awaited.h"
#include "tests/runtime/fake_clock.h"
#include "tests/runtime/small_scene.h"

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
  EXPECT_EQ(decode_topology(*topology->payload)->bodies.size(), 2u);
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
