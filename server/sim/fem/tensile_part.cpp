#include "server/sim/fem/tensile_part.h"

namespace crumple::sim::fem {
namespace {

Quad positive(Quad s) { return s > Quad{} ? s : Quad{}; }
Quad or_one(Quad s) { return s > Quad{} ? s : quad(1); }  // of a divisor

// cos(acos(r) / 3) for r in [0, 1], of Smith's formula: the root of 4 c^3 - 3 c = r from sqrt(3) / 2 on, by Newton from the chord.
Quad cosine_of_third(Quad r) {
  constexpr double kLeast = 0.86602540378443864676;
  Quad c = multiply_add(r, quad(1 - kLeast), quad(kLeast));
  for (int k = 0; k < 4; ++k) {
    const Quad square = c * c;
    c = c - (c * (4 * square - 3) - r) / (12 * square - 3);
  }
  return c;
}

}  // namespace

// Without eigenvectors, as a polynomial in sigma. The eigenvalue that stands apart from the two others is Smith's (SM), and well
// conditioned. So, which is ours, are the projector P on its direction and the deviator D of what is left in the plane across,
// whatever coincides:
//   sigma = m I + p L,  |L|^2 = 6,  L P = k P,  sigma = (m + p k) P + (m - p k / 2) (I - P) + D,  D's eigenvalues +-d and 0,
// and max(0, .) takes each of the eigenvalues m + p k, m - p k / 2 +- d by itself.
QuadMatrix tensile_parts(const QuadMatrix& sigma) {
  const Quad m = (sigma(0, 0) + sigma(1, 1) + sigma(2, 2)) / 3;
  QuadMatrix L = sigma;
  for (int i = 0; i < 3; ++i) L(i, i) -= m;
  const Quad p = square_root(squared_norm(L) / 6), scale = 1 / or_one(p);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) L(i, j) = p > Quad{} ? scale * L(i, j) : quad(i != j ? 0 : i == 0 ? 2 : -1);  // none: any will do
  const Quad half_det = 0.5 * first_column_dot(cofactors(L), L), size = half_det < Quad{} ? -half_det : half_det;
  const Quad twice = 2 * cosine_of_third(size < quad(1) ? size : quad(1));
  const Quad k = half_det < Quad{} ? -twice : twice;

  const QuadMatrix square = product(L, L);
  const Quad share = 1 / (3 * k * k - 3), apart = k * k - 3;
  QuadMatrix P, across, D;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      P(i, j) = share * (square(i, j) + k * L(i, j) + (i == j ? apart : Quad{}));
      across(i, j) = quad(i == j ? 1 : 0) - P(i, j);
      D(i, j) = p * (L(i, j) - k * P(i, j) + 0.5 * k * across(i, j));
    }
  const Quad mean = m - 0.5 * p * k, d = square_root(0.5 * squared_norm(D));
  const Quad high = positive(mean + d), low = positive(mean - d);
  const Quad of_P = positive(m + p * k), of_across = 0.5 * (high + low), of_D = (high - low) / (2 * or_one(d));  // d = 0: high is low
  QuadMatrix part;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) part(i, j) = of_P * P(i, j) + of_across * across(i, j) + of_D * D(i, j);
  return part;
}

Mat3 tensile_part(const Mat3& sigma) {
  QuadMatrix same;
  for (int k = 0; k < 9; ++k) same.m[k] = quad(sigma.data()[k]);
  const QuadMatrix part = tensile_parts(same);
  Mat3 one;
  for (int k = 0; k < 9; ++k) one.data()[k] = part.m[k][0];
  return one;
}

}  // namespace crumple::sim::fem
