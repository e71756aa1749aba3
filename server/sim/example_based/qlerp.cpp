#include "server/sim/example_based/qlerp.h"

#include <cassert>
#include <cmath>

namespace crumple::sim::example_based {
namespace {

constexpr double kHalfTurn = 1e-9;  // |q_e . q_0| that counts as a half turn

}  // namespace

std::vector<std::int8_t> alignment_signs(std::span<const Quat> q) {
  assert(!q.empty());
  std::vector<std::int8_t> signs(q.size(), 1);
  Vec4 half_turns = Vec4::Zero();
  for (std::size_t e = 1; e < q.size(); ++e) {
    double along = q[e].dot(q[0]);
    if (std::abs(along) <= kHalfTurn) {
      // Seen from the rest pose, so that its own stored sign makes no difference either.
      const Vec4 half_turn = (q[0].conjugate() * q[e]).coeffs();
      along = half_turns.dot(half_turn);
      if (std::abs(along) <= kHalfTurn) {
        int largest = 0;
        half_turn.cwiseAbs().maxCoeff(&largest);
        along = half_turn[largest];
      }
      half_turns += (along >= 0 ? 1.0 : -1.0) * half_turn;
    }
    signs[e] = along >= 0 ? 1 : -1;
  }
  return signs;
}

Vec4 guarded_derivative(const Vec4& Q, const Vec4& q_rest, const Vec4& p) {
  const double norm2 = Q.squaredNorm();
  if (norm2 >= kMinBlendNorm * kMinBlendNorm || norm2 == 0) return p;
  return p - Q.dot(p) / std::sqrt(norm2) * q_rest;
}

Vec3 rotate(const Vec4& Q, const Vec3& u) {
  const Vec3 v = Q.head<3>();
  const Vec3 c = v.cross(u);
  return u + (2 / Q.squaredNorm()) * (Q.w() * c + v.cross(c));
}

Vec3 rotate_derivative(const Vec4& Q, const Vec4& p, const Vec3& u) {
  const Vec3 v = Q.head<3>(), dv = p.head<3>();
  const Vec3 c = v.cross(u), dc = dv.cross(u);
  const double norm2 = Q.squaredNorm();
  const Vec3 g = Q.w() * c + v.cross(c);
  const Vec3 dg = p.w() * c + Q.w() * dc + dv.cross(c) + v.cross(dc);
  return (2 / norm2) * (dg - g * (2 * Q.dot(p) / norm2));
}

}  // namespace crumple::sim::example_based
