#include "server/sim/islands/stillness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace crumple::sim::islands {
namespace {

constexpr double kDt = 1.0 / 60;
constexpr StillnessBounds kBounds{0.005, 0.0005};

// Steps of rest of a body that follows `motion` for `seconds`, at its end and at most.
struct Outcome {
  int last = 0, most = 0;
};
Outcome follow(const std::function<Vec3(double)>& motion, double seconds, double dt = kDt, const StillnessBounds& bounds = kBounds) {
  Stillness points;
  Outcome outcome;
  for (int k = 0; k * dt <= seconds; ++k) {
    const Vec3 x[] = {Vec3::Zero(), motion(k * dt)};
    observe(x, dt, bounds, points);
    outcome = {points.steps, std::max(outcome.most, points.steps)};
  }
  return outcome;
}

TEST(Stillness, CountsStepsOfABodyThatStays) {
  EXPECT_GE(follow([](double) { return Vec3(1, 2, 3); }, 1).last, 58);
}

TEST(Stillness, ASlowSlideIsNoRest) {
  // 3 mm/s is below the speed, but half a millimetre is gone after 10 steps.
  EXPECT_LE(follow([](double t) { return Vec3(0.003 * t, 0, 0); }, 10).most, 12);
}

TEST(Stillness, ASwingIsNoRestAtItsTurningPoints) {
  for (const double period : {0.2, 1.0, 3.0}) {
    const auto swing = [&](double t) { return Vec3(0.005 * std::cos(2 * M_PI * t / period), 0, 0); };
    EXPECT_LT(follow(swing, 4 * period).most, 30) << period;
    EXPECT_LT(follow(swing, 4 * period, 1e-3).most, 500) << period;
  }
}

TEST(Stillness, AVibrationOfSmallAmplitudeIsNoRest) {
  // 0.2 mm at 10 Hz: within the radius, at 12 mm/s.
  EXPECT_LT(follow([](double t) { return Vec3(0.0002 * std::sin(2 * M_PI * 10 * t), 0, 0); }, 5).most, 5);
}

TEST(Stillness, ANodeThatGoesUpAndDownByTurnsRests) {
  const auto chatter = [](double by) {
    return [=](double t) { return Vec3(0, std::lround(t / kDt) % 2 ? by : -by, 0); };
  };
  EXPECT_GE(follow(chatter(0.0008), 1).last, 55);  // 96 mm/s up, 96 mm/s down
  EXPECT_EQ(follow(chatter(0.0012), 1).most, 0);
}

// As a fragment was seen to do in a heap: for eight steps it sinks, by 0.27 mm in all, and is put back in the ninth.
TEST(Stillness, WhatSinksAndIsPutBackRestsInTheMean) {
  const auto sawtooth = [](double by) {
    return [=](double t) { return Vec3(0, -by * static_cast<double>(std::lround(t / kDt) % 9) / 8, 0); };
  };
  constexpr StillnessBounds kMean{kBounds.speed, kBounds.radius, 0.05};
  EXPECT_LT(follow(sawtooth(0.00027), 5).most, 10);
  EXPECT_GE(follow(sawtooth(0.00027), 5, kDt, kMean).last, 250);
  EXPECT_LT(follow(sawtooth(0.002), 5, kDt, kMean).most, 10);
  // What moves does not rest in the mean either, and what stops rests soon.
  EXPECT_LE(follow([](double t) { return Vec3(0.003 * t, 0, 0); }, 10, kDt, kMean).most, 15);
  EXPECT_LT(follow([](double t) { return Vec3(0.005 * std::cos(2 * M_PI * t), 0, 0); }, 4, kDt, kMean).most, 30);
  EXPECT_GE(follow([](double t) { return Vec3(std::min(t, 1.0), 0, 0); }, 1.5, kDt, kMean).last, 22);
}

TEST(Stillness, BeginsAnewWhereNodesAreAdded) {
  Stillness points;
  const std::vector<Vec3> two(2, Vec3::Zero()), three(3, Vec3::Zero());
  for (int k = 0; k < 10; ++k) observe(two, kDt, kBounds, points);
  EXPECT_GT(points.steps, 5);
  observe(three, kDt, kBounds, points);
  EXPECT_EQ(points.steps, 0);
}

TEST(Stillness, WhatIsNotFiniteDoesNotRest) {
  EXPECT_EQ(follow([](double) { return Vec3(0, std::nan(""), 0); }, 1).most, 0);
}

}  // namespace
}  // namespace crumple::sim::islands
