#include "server/runtime/step_clock.h"

#include <gtest/gtest.h>

namespace crumple::runtime {
namespace {

constexpr double kDt = 0.01;

// Plays for `wall` seconds when a step costs `cost` seconds; answers the number of steps.
int play(StepClock& clock, double& now, double wall, double cost) {
  const double end = now + wall;
  int steps = 0;
  while (true) {
    now = std::max(now, clock.next_step_at());
    if (now >= end) return steps;
    now += cost;
    clock.stepped(now);
    ++steps;
  }
}

TEST(StepClock, TakesAsManyStepsAsWallTimeHolds) {
  StepClock clock(kDt);
  double now = 5;
  clock.play(now);
  EXPECT_NEAR(play(clock, now, 3, 0.002), 300, 1);
  EXPECT_NEAR(clock.real_time_factor(), 1, 0.02);
  EXPECT_EQ(clock.dropped_seconds(), 0);
}

TEST(StepClock, SpeedStretchesTime) {
  StepClock clock(kDt);
  double now = 0;
  clock.play(now, 2.5);
  EXPECT_NEAR(play(clock, now, 2, 0.001), 500, 1);
  EXPECT_NEAR(clock.real_time_factor(), 2.5, 0.05);
}

TEST(StepClock, ASlowWorldRunsSlowerAndOwesNoMoreThanTheBound) {
  StepClock clock(kDt, 0.1);
  double now = 0;
  clock.play(now);
  const int steps = play(clock, now, 10, 0.04);  // four times too slow
  EXPECT_NEAR(steps, 250, 1);
  EXPECT_NEAR(clock.real_time_factor(), 0.25, 0.005);
  EXPECT_LE(now - clock.next_step_at(), 0.1 + 1e-12);
  EXPECT_NEAR(clock.dropped_seconds(), 10 - 250 * kDt - 0.1, 0.05);  // all it owed, but the bound
}

TEST(StepClock, CatchesUpAShortStallAndNoMoreThanTheBoundOfALongOne) {
  StepClock clock(kDt, 0.1);
  double now = 0;
  clock.play(now);
  now = 0.05;
  clock.stepped(now);  // stalled 50 ms in the first step
  EXPECT_NEAR(play(clock, now, 0.0001, 0), 5, 1);  // those of the stall, at once
  now += 60;
  clock.stepped(now);  // stalled a minute
  EXPECT_NEAR(play(clock, now, 0.0001, 0), 11, 1);  // 0.1 s worth of them, not 6000
}

TEST(StepClock, HasNoFactorWhenPaused) {
  StepClock clock(kDt);
  clock.play(0);
  clock.stepped(0.01);
  EXPECT_GT(clock.real_time_factor(), 0);
  clock.pause();
  EXPECT_FALSE(clock.playing());
  EXPECT_EQ(clock.real_time_factor(), 0);
}

}  // namespace
}  // namespace crumple::runtime
