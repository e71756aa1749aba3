#include "server/sim/fem/hexahedron_states.h"

#include "server/sim/cross_matrix.h"

#include <Eigen/LU>

#include <cmath>

namespace crumple::sim::fem {

HexahedronForces hexahedron_forces(const MacroElements& m, int d, const Mat38& Y, const Mat3& S) {
  HexahedronForces forces{m.shape(d).forces(Y), Mat3::Zero()};
  Vec3 moment = Vec3::Zero();
  for (int a = 0; a < 8; ++a) moment += Vec3(Y.col(a)).cross(forces.corner[a]);
  forces.stress = moment_balance(S, Vec3(-moment / m.volume[d]));
  return forces;
}

Mat38 local_corners(const MacroElements& m, int d, const std::vector<Vec3>& x, const Mat3& Q) {
  const int* nodes = &m.nodes[8 * d];
  Mat38 Y = Mat38::Zero();
  for (int a = 1; a < 8; ++a) Y.col(a) = Q.transpose() * (x[nodes[a]] - x[nodes[0]]);
  return Y;
}

bool in_hexahedron(const MacroElements& m, const MacroStates& e, int t) {
  const int d = m.of_tet[2 * t];
  return d < m.hexahedra && !e.split[d];
}

Mat3 hexahedron_stress(const RestBody& rest, const MacroStates& e, int t) {
  const MacroElements& m = rest.macros;
  const int d = m.of_tet[2 * t];
  const Mat3 sigma = e.sigma[d] + isotropic_stress(rest.lame_of(t), m.shape(d).strain_deviation(m.cells.order[t], e.Y[d]));
  return e.Q[d] * sigma * e.Q[d].transpose();
}

Mat34 hexahedron_normals(const RestBody& rest, const MacroStates& e, int t) {
  return -3 * rest.fill[t] * rest.volume[t] * e.Q[rest.macros.of_tet[2 * t]] * rest.gradients(t);
}

void add_hexahedron_block(const MacroElements& m, const MacroStates& e, int a, int b, double factor, Quad (&block)[3]) {
  const int d = a / 8;
  if (e.split[d]) return;
  const double* Q = e.Q[d].data();
  const double* H = m.shape(d).H[8 * (a % 8) + b % 8].data();
  const Quad q[3] = {load_three(Q), load_three(Q + 3), load_three(Q + 6)};
  Quad turned[3];
  for (int k = 0; k < 3; ++k)
    turned[k] = multiply_add(q[2], quad(H[3 * k + 2]), multiply_add(q[1], quad(H[3 * k + 1]), q[0] * quad(H[3 * k])));
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) block[j] = multiply_add(turned[k], quad(factor * Q[3 * k + j]), block[j]);
}

double hexahedron_energy(const MacroElements& m, int d, const Mat38& Y) {
  const std::array<Vec3, 8> f = m.shape(d).forces(Y);
  double twice = 0;
  for (int a = 0; a < 8; ++a) twice += f[a].dot(Y.col(a));
  return 0.5 * twice;
}

Eigen::Matrix<double, 24, 24> exact_hexahedron_stiffness(const MacroElements& m, int d, const Mat38& Y, const Mat3& Q, const Mat3& F) {
  const Mat3 S = symmetric_part(Q.transpose() * F), G = (S.trace() * Mat3::Identity() - S).inverse();
  const double to_gradient = -1 / std::sqrt(m.volume[d]);
  Eigen::Matrix<double, 24, 24> J, H;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b) {
      const Vec3 g = to_gradient * m.core[8 * d + b];
      J.block<3, 3>(3 * a, 3 * b) = ((a == b) * Mat3::Identity() + cross_matrix(Y.col(a)) * G * cross_matrix(g)) * Q.transpose();
      H.block<3, 3>(3 * a, 3 * b) = m.shape(d).H[8 * a + b];
    }
  return J.transpose() * H * J;
}

}  // namespace crumple::sim::fem
