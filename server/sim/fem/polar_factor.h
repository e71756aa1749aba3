#pragma once

#include "server/sim/fem/lane_matrix.h"

// The rotation R of F = R U, U symmetric and positive, in closed form but for one root. With the invariants of U
//   I1 = tr U, I2 = (I1^2 - |F|^2) / 2, I3 = det F
// Cayley and Hamilton's theorem gives (HC, solved for R instead of U)
//   R = ((I1^2 - I2) F + I1 cof F - F F^T F) / (I1 I2 - I3),
// and I1 is the largest root of the quartic whose roots are the s1 + s2 + s3 with an even number of signs turned,
//   t^4 - 2 |F|^2 t^2 - 8 det F t + |F|^4 - 4 |cof F|^2.
// sqrt(3) |F| is not below it and all four roots are real, so that Newton's iteration goes down to it and nowhere else: three
// or four divisions for usual F, where Newton's iteration on F itself inverts as many matrices.
namespace crumple::sim::fem {

inline constexpr double kWellPositive = 1e-5;  // det F over |F|^3 from which on it is used; at rest 0.19

// norm2: |F|^2, whose square must be a number.
template <class S>
auto well_positive(S det, S norm2) -> decltype(det > norm2) {
  return (det > kWellPositive * norm2 * square_root(norm2)) & (norm2 > 1e-60 + 0 * norm2) & (norm2 < 1e60 + 0 * norm2);
}

inline constexpr int kMaxTraceNewton = 30;  // 12 at the worst F that is let in (kWellPositive)

// C: F's cofactors. Only where well_positive: the denominator is (s1 + s2)(s2 + s3)(s3 + s1). To 1e-15 for usual F, 1e-12 at
// the worst of these.
template <class S>
LaneMatrix<S> polar_factor(const LaneMatrix<S>& F, const LaneMatrix<S>& C, S det, S norm2) {
  const S c1 = -8 * det, c0 = norm2 * norm2 - 4 * squared_norm(C);
  S t = square_root(3 * norm2);
  auto done = t != t;
  for (int step = 0; step < kMaxTraceNewton && !all(done); ++step) {
    const S t2 = t * t;
    const S value = multiply_add(multiply_add(t2 - 2 * norm2, t, c1), t, c0);
    const S slope = multiply_add(4 * t, t2 - norm2, c1);
    const S change = value / slope;
    t = done ? t : t - change;
    done = done | !(change > 1e-9 * t);  // quadratic: what is left is rounding
  }
  const S i2 = 0.5 * (t * t - norm2), scale = 1 / multiply_add(t, i2, -det);
  const S of_F = scale * (t * t - i2), of_C = scale * t;
  const LaneMatrix<S> third = product(F, transposed_product(F, F));
  LaneMatrix<S> R;
  for (int k = 0; k < 9; ++k) R.m[k] = multiply_add(of_F, F.m[k], of_C * C.m[k] - scale * third.m[k]);
  return R;
}

}  // namespace crumple::sim::fem
