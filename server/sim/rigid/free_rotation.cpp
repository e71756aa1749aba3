#include "server/sim/rigid/free_rotation.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim {
namespace {

constexpr int kMaxParts = 64;
constexpr double kTurnPerPart = 0.5;  // of the fixed-point iteration's contraction factor [rad]

Quat midpoint(const Quat& R, const Vec3& I, const Vec3& L, double dt) {
  Vec3 w = angular_velocity(R, I, L);
  for (int i = 0; i < 60; ++i) {
    const Vec3 next = angular_velocity(turned(R, dt / 2 * w), I, L);
    const double change = (next - w).norm() * std::abs(dt);
    w = next;
    if (change < 1e-15) break;
  }
  return turned(R, dt * w);
}

// Half a turn about axes 1 and 2, a whole one about 3, and back: each the exact flow of L_k^2 / (2 I_k).
Quat splitting(Quat R, const Vec3& I, const Vec3& L, double dt) {
  constexpr int axis[5] = {0, 1, 2, 1, 0};
  for (int i = 0; i < 5; ++i) {
    const int k = axis[i];
    const Vec3 e = R * Vec3::Unit(k);
    R = turned(R, (i == 2 ? dt : dt / 2) * e.dot(L) / I[k] * e);
  }
  return R;
}

}  // namespace

Vec3 angular_velocity(const Quat& R_WP, const Vec3& I, const Vec3& L_W) {
  return R_WP * Vec3((R_WP.conjugate() * L_W).cwiseQuotient(I));
}

Mat3 world_inertia(const Quat& R_WP, const Vec3& I) {
  const Mat3 R = R_WP.toRotationMatrix();
  return R * I.asDiagonal() * R.transpose();
}

Quat turned(const Quat& R_WP, const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0) return R_WP;
  return (Quat(Eigen::AngleAxisd(angle, turn / angle)) * R_WP).normalized();
}

Quat rotate_freely(const Quat& R_WP, const Vec3& I, const Vec3& L_W, double dt) {
  if (dt == 0 || L_W.isZero(0)) return R_WP;
  const double turn = L_W.norm() / I.minCoeff() * std::abs(dt);
  const int parts = static_cast<int>(std::clamp(std::ceil(turn / kTurnPerPart), 1.0, double{kMaxParts}));
  const bool converges = turn <= kTurnPerPart * kMaxParts;
  Quat R = R_WP;
  for (int i = 0; i < parts; ++i) {
    R = converges ? midpoint(R, I, L_W, dt / parts) : splitting(R, I, L_W, dt / parts);
  }
  return R;
}

}  // namespace crumple::sim
