#include "server/sim/rigid/free_rotation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace crumple::sim {
namespace {

double energy(const Quat& R, const Vec3& I, const Vec3& L) { return 0.5 * L.dot(angular_velocity(R, I, L)); }

// FORMULAS F11: spin about the middle axis, slightly disturbed, turns over again and again (Dzhanibekov).
TEST(FreeRotation, MiddleAxisFlipsAndEnergyStays) {
  const Vec3 I(1, 2, 3);
  for (const double dt : {1.0 / 250, 1.0 / 60}) {
    Quat R = Quat::Identity();
    const Vec3 L = I.cwiseProduct(Vec3(1e-3, 1, 1e-3));
    const double E = energy(R, I, L);
    double worst = 0;
    int flips = 0;
    bool up = true;
    for (int i = 0; i < 60 / dt; ++i) {
      R = rotate_freely(R, I, L, dt);
      worst = std::max(worst, std::abs(energy(R, I, L) / E - 1));
      const double w2 = (R.conjugate() * angular_velocity(R, I, L)).y();
      if (up ? w2 < -0.9 : w2 > 0.9) up = !up, ++flips;
    }
    EXPECT_GE(flips, 2);
    EXPECT_LT(worst, 1e-3);
  }
}

// Time of the flip from Euler's equations in body axes, I w' = (I w) x w, by Runge-Kutta with a step 40 times smaller.
TEST(FreeRotation, FlipsWhenEulersEquationsSay) {
  const Vec3 I(1, 2, 3);
  const auto rate = [&](const Vec3& w) { return Vec3(I.cwiseProduct(w).cross(w).cwiseQuotient(I)); };
  Vec3 w(1e-3, 1, 1e-3);
  double flip = 0;
  for (const double h = 1e-4; w.y() > 0; flip += h) {
    const Vec3 k1 = rate(w), k2 = rate(w + h / 2 * k1), k3 = rate(w + h / 2 * k2), k4 = rate(w + h * k3);
    w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  Quat R = Quat::Identity();
  const Vec3 L(1e-3, 2, 3e-3);
  double t = 0;
  for (const double dt = 1.0 / 250; (R.conjugate() * angular_velocity(R, I, L)).y() > 0; t += dt) {
    R = rotate_freely(R, I, L, dt);
  }
  EXPECT_NEAR(t, flip, 0.01);
}

TEST(FreeRotation, SymmetricTopPrecessesInClosedForm) {  // about L at |L|/I_1, whatever its spin
  const Vec3 I(2, 2, 1), L(0.5, 0, 3);
  Quat R = Quat::Identity();
  const double dt = 1e-3;
  for (int i = 0; i < 1000; ++i) R = rotate_freely(R, I, L, dt);
  const Vec3 axis = Eigen::AngleAxisd(L.norm() / 2, L.normalized()) * Vec3::UnitZ();
  EXPECT_LT((R * Vec3::UnitZ() - axis).norm(), 1e-6);  // second order: 4e-8 per unit of (w dt)^2
}

TEST(FreeRotation, RunsBackwards) {
  const Vec3 I(1, 2, 3), L(1, -2, 0.5);
  const Quat R(Eigen::AngleAxisd(1, Vec3(1, 1, 0).normalized()));
  EXPECT_LT(rotate_freely(rotate_freely(R, I, L, 0.01), I, L, -0.01).angularDistance(R), 1e-12);
}

TEST(FreeRotation, NeedleSpunAcrossKeepsItsEnergy) {  // I_min 1e-6 of I_max: the splitting
  const Vec3 I(1e-6, 1, 1), L(1e-7, 30, 20);
  Quat R = Quat::Identity();
  const double E = energy(R, I, L);
  for (int i = 0; i < 2000; ++i) {
    R = rotate_freely(R, I, L, 1.0 / 60);
    ASSERT_NEAR(energy(R, I, L) / E, 1, 1e-3) << i;
  }
}

}  // namespace
}  // namespace crumple::sim
