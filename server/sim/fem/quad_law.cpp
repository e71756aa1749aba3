#include "server/sim/fem/quad_law.h"

#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/rotation.h"

namespace crumple::sim::fem {
namespace {

// As polar_rotation, by Newton's iteration. False if a lane does not converge.
bool polar_rotations(const QuadMatrix& F, QuadMatrix& Q) {
  Q = F;
  Mask done{}, near{};
  for (int step = 0; step < kMaxPolarNewton; ++step) {
    const QuadMatrix C = cofactors(Q);
    const Quad det = first_column_dot(C, Q);
    Quad gamma = quad(1);
    if (any(~near)) {
      const Quad scale = square_root(square_root(squared_norm(C) / squared_norm(Q)) / det);
      gamma = near ? gamma : scale;
    }
    const Quad a = 0.5 * gamma, b = 0.5 / (gamma * det);
    Quad change{};
    for (int k = 0; k < 9; ++k) {
      const Quad next = a * Q.m[k] + b * C.m[k], d = next - Q.m[k];
      change += d * d;
      Q.m[k] = done ? Q.m[k] : next;
    }
    near = near | (change < quad(1e-4));
    done = done | (change < quad(1e-16));
    if (!any(~done)) return true;
  }
  return false;
}

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

}  // namespace

void QuadLaw::set_material(int lane, const FemMaterial& material, const Lame& lame, const Mat3& plastic_strain) {
  lambda_[lane] = lame.lambda;
  mu_[lane] = lame.mu;
  qr_[lane] = material.rotation == RotationRule::polar_qr ? -1 : 0;
  balanced_[lane] = balances_moment(material, plastic_strain) ? -1 : 0;
}

bool QuadLaw::update(const QuadMatrix& F, const QuadMatrix& plastic_strain) {
  const Quad det = first_column_dot(cofactors(F), F), norm2 = squared_norm(F);
  if (!(det[0] > 0 && det[1] > 0 && det[2] > 0 && det[3] > 0)) return false;
  if (any(~(det > quad(kWellPositive) * norm2 * square_root(norm2)))) return false;
  if (any(qr_ & (det < quad(kQrVolumeRatio)))) return false;
  if (!polar_rotations(F, Q)) return false;

  const QuadMatrix S = transposed_product(Q, F);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) sigma(i, j) = 0.5 * (S(i, j) + S(j, i)) - plastic_strain(i, j) - quad(i == j ? 1 : 0);
  const Quad pressure = lambda_ * (sigma(0, 0) + sigma(1, 1) + sigma(2, 2));
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) sigma(i, j) = 2 * mu_ * sigma(i, j) + (i == j ? pressure : Quad{});

  stress = sigma;
  if (!any(balanced_)) return true;
  QuadMatrix symmetric;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) symmetric(i, j) = 0.5 * (S(i, j) + S(j, i));
  add_moment_balance(symmetric, sigma, balanced_, stress);
  return true;
}

}  // namespace crumple::sim::fem
