#include "server/sim/fem/quad_law.h"

#include "server/sim/fem/polar_factor.h"
#include "server/sim/fem/rotation.h"

namespace crumple::sim::fem {
namespace {

// As moment_balance, added to the stress of the lanes that are asked for it. S: symmetric.
void add_moment_balance(const QuadMatrix& S, const QuadMatrix& sigma, Mask lanes, QuadMatrix& stress) {
  const QuadMatrix C = product(S, sigma);
  const Quad axial[3] = {C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)};
  const Quad trace = S(0, 0) + S(1, 1) + S(2, 2);
  QuadMatrix G;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) G(i, j) = (i == j ? trace : Quad{}) - S(i, j);
  const QuadMatrix adjugate = cofactors(G);
  Quad det = first_column_dot(adjugate, G);
  det = det > Quad{} ? det : Quad{};
  const Quad floored = det > quad(kBalanceFades) ? det : quad(kBalanceFades);
  const Quad factor = lanes ? det / (floored * floored) : Quad{};
  Quad a[3];
  for (int j = 0; j < 3; ++j)
    a[j] = factor * (adjugate(0, j) * axial[0] + adjugate(1, j) * axial[1] + adjugate(2, j) * axial[2]);
  for (int j = 0; j < 3; ++j) {
    const int p = (j + 1) % 3, q = (j + 2) % 3;
    stress(q, p) += a[j];
    stress(p, q) -= a[j];
  }
}

// Where any of the entries is not zero.
Mask nonzero(const QuadMatrix& a) {
  Mask mask = a.m[0] != Quad{};
  for (int k = 1; k < 9; ++k) mask = mask | (a.m[k] != Quad{});
  return mask;
}

}  // namespace

Quad QuadLaw::energy_density() const {
  const Quad share = lambda_ / (3 * lambda_ + 2 * mu_), trace = sigma(0, 0) + sigma(1, 1) + sigma(2, 2);
  return (squared_norm(sigma) - share * trace * trace) / (4 * mu_);
}

bool QuadLaw::update(const QuadMatrix& F, const QuadMatrix& plastic_strain) {
  const QuadMatrix C = cofactors(F);
  const Quad det = first_column_dot(C, F), norm2 = squared_norm(F);
  if (!all(well_positive(det, norm2))) return false;
  if (any(qr_ & (det < quad(kQrVolumeRatio)))) return false;
  Q = polar_factor(F, C, det, norm2);

  QuadMatrix S = transposed_product(Q, F);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < j; ++i) S(i, j) = S(j, i) = 0.5 * (S(i, j) + S(j, i));
  const Quad trace = S(0, 0) + S(1, 1) + S(2, 2) - plastic_strain(0, 0) - plastic_strain(1, 1) - plastic_strain(2, 2) - 3;
  const Quad pressure = lambda_ * trace;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      sigma(i, j) = 2 * mu_ * (S(i, j) - plastic_strain(i, j) - quad(i == j ? 1 : 0));
      if (i == j) sigma(i, j) += pressure;
    }
  stress = sigma;
  if (!any(deviatoric_)) return true;
  const Mask balanced = deviatoric_ & nonzero(plastic_strain);  // balances_moment
  if (any(balanced)) add_moment_balance(S, sigma, balanced, stress);
  return true;
}

}  // namespace crumple::sim::fem
