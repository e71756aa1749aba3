#pragma once

#include "common/types.h"

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

// Quaternion linear interpolation (QLERP; Kavan & Zara 2005), which Jones et al. 2016, eq. 3, blends rotations with.
// Quaternions are 4-vectors (x, y, z, w) here, because they are added and scaled.
namespace crumple::sim::example_based {

using Vec4 = Eigen::Vector4d;

// A blend shorter than this is lengthened along the rest pose's quaternion, see `guarded`.
inline constexpr double kMinBlendNorm = 1e-3;

// s_e = +-1 for each pose of one bone, so that s_e q_e lies on the rest pose's half of the sphere: q_e and -q_e turn
// the same way, but their sums do not. +1 where q_e . q_0 >= 0. A half turn from the rest pose (|q_e . q_0| <= 1e-9,
// where that sign is only rounding) is aligned with the half turns before it instead, the first one so that the largest
// component of the turn from the rest pose is positive: two poses with the same half turn then never cancel, and a pose
// turns the same way round, however any of them was stored.
// q: the poses of one bone, normalised; q[0] is the rest pose.
std::vector<std::int8_t> alignment_signs(std::span<const Quat> q);

// Q, or Q + (kMinBlendNorm - |Q|) q_rest where |Q| is less. Continuous in Q. Aligned poses and weights >= 0 give
// Q . q_rest >= 0, so the result is never shorter than kMinBlendNorm / sqrt(2): no blend divides by zero, not even of
// opposite half turns. Authors should keep each bone within 180 degrees of its rest pose and add a bone between.
// (Inline: it stands in the innermost loop of skinning, which keeps its sums in registers.)
inline Vec4 guarded(const Vec4& Q, const Vec4& q_rest) {
  const double norm2 = Q.squaredNorm();
  if (norm2 >= kMinBlendNorm * kMinBlendNorm) [[likely]]
    return Q;
  return Q + (kMinBlendNorm - std::sqrt(norm2)) * q_rest;
}

// Derivative of `guarded` along p; at Q = 0, where it has none, that of the unguarded blend.
Vec4 guarded_derivative(const Vec4& Q, const Vec4& q_rest, const Vec4& p);

// R(Q / |Q|) u, without a square root: u + 2 / |Q|^2 (w c + v x c) with c = v x u, Q = (v, w).
Vec3 rotate(const Vec4& Q, const Vec3& u);

// Derivative of rotate(Q, u) when Q changes by p, through the normalisation.
Vec3 rotate_derivative(const Vec4& Q, const Vec4& p, const Vec3& u);

}  // namespace crumple::sim::example_based
