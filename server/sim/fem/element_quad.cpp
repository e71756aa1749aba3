#include "server/sim/fem/element_quad.h"

#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/quad.h"
#include "server/sim/fem/rotation.h"

namespace crumple::sim::fem {
namespace {

using Mask = long long __attribute__((vector_size(32)));

bool any(Mask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

// A 3x3 matrix of each of four tets, by columns.
struct QuadMatrix {
  Quad m[9];

  Quad& operator()(int i, int j) { return m[3 * j + i]; }
  Quad operator()(int i, int j) const { return m[3 * j + i]; }
};

QuadMatrix product(const QuadMatrix& a, const QuadMatrix& b) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) c(i, j) = a(i, 0) * b(0, j) + a(i, 1) * b(1, j) + a(i, 2) * b(2, j);
  return c;
}

// a^T b
QuadMatrix transposed_product(const QuadMatrix& a, const QuadMatrix& b) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) c(i, j) = a(0, i) * b(0, j) + a(1, i) * b(1, j) + a(2, i) * b(2, j);
  return c;
}

// det a a^-T: the cross products of a's columns.
QuadMatrix cofactors(const QuadMatrix& a) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j) {
    const int p = (j + 1) % 3, q = (j + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      const int r = (i + 1) % 3, s = (i + 2) % 3;
      c(i, j) = a(r, p) * a(s, q) - a(s, p) * a(r, q);
    }
  }
  return c;
}

Quad squared_norm(const QuadMatrix& a) {
  Quad sum = a.m[0] * a.m[0];
  for (int k = 1; k < 9; ++k) sum += a.m[k] * a.m[k];
  return sum;
}

Quad first_column_dot(const QuadMatrix& a, const QuadMatrix& b) { return a(0, 0) * b(0, 0) + a(1, 0) * b(1, 0) + a(2, 0) * b(2, 0); }

template <class Array>
QuadMatrix load(const Array& per_tet, int t) {
  QuadMatrix a;
  const double* p[4] = {per_tet[t].data(), per_tet[t + 1].data(), per_tet[t + 2].data(), per_tet[t + 3].data()};
  for (int k = 0; k < 9; ++k) a.m[k] = Quad{p[0][k], p[1][k], p[2][k], p[3][k]};
  return a;
}

void store(const QuadMatrix& a, int lane, double* to) {
  for (int k = 0; k < 9; ++k) to[k] = a.m[k][lane];
}

// D_x beta of four tets.
QuadMatrix deformation_gradients(const std::vector<Tet>& tets, int t, std::span<const Vec3> x, const QuadMatrix& beta) {
  QuadMatrix D;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) {
      Quad& d = D(i, k);
      for (int lane = 0; lane < 4; ++lane) d[lane] = x[tets[t + lane][k + 1]][i] - x[tets[t + lane][0]][i];
    }
  return product(D, beta);
}

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

bool update_element_quad(const RestBody& rest, const std::vector<Tet>& tets, int t, std::span<const Vec3> x,
                         const std::vector<Mat3>& plastic_strain, Elements& e) {
  if (!rest.beta_clamped.empty()) return false;
  const QuadMatrix beta = load(rest.beta, t);
  const QuadMatrix F = deformation_gradients(tets, t, x, beta);
  const Quad det = first_column_dot(cofactors(F), F), norm2 = squared_norm(F);
  if (!(det[0] > 0 && det[1] > 0 && det[2] > 0 && det[3] > 0)) return false;
  if (any(~(det > quad(kWellPositive) * norm2 * square_root(norm2)))) return false;
  for (int lane = 0; lane < 4; ++lane)
    if (det[lane] < kQrVolumeRatio && rest.material_of(t + lane).rotation == RotationRule::polar_qr) return false;
  QuadMatrix Q;
  if (!polar_rotations(F, Q)) return false;

  const QuadMatrix S = transposed_product(Q, F);
  const QuadMatrix plastic = load(plastic_strain, t);
  Quad lambda = quad(rest.lame.lambda), mu = quad(rest.lame.mu), scale;
  for (int lane = 0; lane < 4; ++lane) scale[lane] = rest.fill[t + lane] * rest.volume[t + lane];
  for (int lane = 0; lane < 4 && rest.heterogeneous(); ++lane) {
    lambda[lane] = rest.lame_of(t + lane).lambda;
    mu[lane] = rest.lame_of(t + lane).mu;
  }
  QuadMatrix sigma;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) sigma(i, j) = 0.5 * (S(i, j) + S(j, i)) - plastic(i, j) - quad(i == j ? 1 : 0);
  const Quad pressure = lambda * (sigma(0, 0) + sigma(1, 1) + sigma(2, 2));
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) sigma(i, j) = 2 * mu * sigma(i, j) + (i == j ? pressure : Quad{});

  QuadMatrix stress = sigma;
  Mask flowed{};
  for (int lane = 0; lane < 4; ++lane)
    flowed[lane] = balances_moment(rest.material_of(t + lane), plastic_strain[t + lane]) ? -1 : 0;
  if (any(flowed)) {
    QuadMatrix S_symmetric;
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) S_symmetric(i, j) = 0.5 * (S(i, j) + S(j, i));
    add_moment_balance(S_symmetric, sigma, flowed, stress);
  }

  // f_i = fill Q sigma n_i / 3 = sqrt(fill V) Q sigma c_i
  QuadMatrix c;
  for (int lane = 0; lane < 4; ++lane)
    for (int k = 0; k < 9; ++k) c.m[k][lane] = rest.core[t + lane].data()[3 + k];
  QuadMatrix P = product(Q, stress);
  for (Quad& p : P.m) p *= square_root(scale);
  const QuadMatrix core = product(Q, c), force = product(P, c);
  for (int lane = 0; lane < 4; ++lane) {
    store(Q, lane, e.Q[t + lane].data());
    store(sigma, lane, e.sigma[t + lane].data());
    store(core, lane, e.core[t + lane].data() + 3);
    store(force, lane, e.force[t + lane].data() + 3);
  }
  // Normals of a closed surface sum to zero; so, exactly, do these.
  for (int lane = 0; lane < 4; ++lane) {
    e.core[t + lane].col(0) = -e.core[t + lane].rightCols<3>().rowwise().sum();
    e.force[t + lane].col(0) = -e.force[t + lane].rightCols<3>().rowwise().sum();
  }
  return true;
}

}  // namespace crumple::sim::fem
