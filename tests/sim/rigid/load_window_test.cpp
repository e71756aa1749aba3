#include "server/sim/rigid/load_window.h"

#include <gtest/gtest.h>

namespace crumple::sim {
namespace {

constexpr double kTime = 1.0 / 60;

double most_of_blow(double dt, double time, double impulse) {
  LoadWindow window(dt, time);
  double most = 0;
  for (int k = 0; k < 3000; ++k) {
    window.add({k == 700 ? Vec3(0, impulse, 0) : Vec3(Vec3::Zero()), Vec3::Zero()});
    most = std::max(most, window.force().norm());
  }
  EXPECT_NEAR(window.force().norm(), 0, 1e-12) << "what is past is forgotten";
  return most;
}

TEST(LoadWindow, ABlowIsItsImpulseOverTheTimeAtEveryStepBelowIt) {
  for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 250, 0.00412, 1.0 / 3840}) EXPECT_NEAR(most_of_blow(dt, kTime, 7), 7 * 60, 1e-9) << dt;
  EXPECT_NEAR(most_of_blow(1.0 / 30, kTime, 7), 7 * 30, 1e-9) << "a step that is longer is the time";
  EXPECT_NEAR(most_of_blow(1.0 / 250, 0, 7), 7 * 250, 1e-9);
  EXPECT_NEAR(most_of_blow(1e-5, kTime, 7), 7 * 60, 1e-9) << "neighbours kept together";
}

TEST(LoadWindow, ALoadThatLastsIsWhatItIs) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 250, 1e-4, 1e-5}) {
    LoadWindow window(dt, kTime);
    for (int k = 0; k < 5000; ++k) {
      window.add({Vec3(3 * dt, 0, 0), Vec3(0, 0, 5 * dt)});
      if (k * dt < kTime + dt) continue;
      ASSERT_NEAR(window.force().x(), 3, 1e-9);
      ASSERT_NEAR(window.moment().z(), 5, 1e-9);
    }
    EXPECT_LE(window.kept().size(), LoadWindow::kSteps + 1u);
  }
}

}  // namespace
}  // namespace crumple::sim
