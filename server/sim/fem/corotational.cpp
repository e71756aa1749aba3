#include "server/sim/fem/corotational.h"

#include "server/sim/cross_matrix.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace crumple::sim::fem {

Lame lame_constants(double young, double poisson) {
  return {young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))};
}

Mat3 corotational_strain(const RestTet& rest, const Mat34& x, const Mat3& Q) {
  return symmetric_part(Q.transpose() * deformation_gradient(x, rest.beta_clamped) - rest.rest_gradient);
}

double von_mises(const Mat3& sigma) {
  const Mat3 deviator = sigma - sigma.trace() / 3 * Mat3::Identity();
  return std::sqrt(1.5) * deviator.norm();
}

Mat34 nodal_forces(const RestTet& rest, const Mat3& Q, const Mat3& sigma) {
  const Mat3 P = rest.fill / 3 * (Q * sigma);
  return P * rest.normals;
}

Mat3 moment_balance(const Mat3& S, const Mat3& sigma) {
  const Mat3 C = S * sigma;  // minus its transpose sigma S
  return moment_balance(S, Vec3(C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)));
}

Mat3 moment_balance(const Mat3& S, const Vec3& axial) {
  const Mat3 G = S.trace() * Mat3::Identity() - S;
  const Vec3 g0 = G.col(0), g1 = G.col(1), g2 = G.col(2), g12 = g1.cross(g2);
  const double det = std::max(0.0, g0.dot(g12)), floored = std::max(det, kBalanceFades);
  const Vec3 adjugate_times_axial(g12.dot(axial), g2.cross(g0).dot(axial), g0.cross(g1).dot(axial));
  return cross_matrix(det / (floored * floored) * adjugate_times_axial);
}

Mat3 stiffness_block(const RestTet& rest, const Lame& lame, const Mat3& Q, int i, int j) {
  const Vec3 n_i = rest.normals.col(i), n_j = rest.normals.col(j);
  const Mat3 core =
      lame.lambda * n_i * n_j.transpose() + lame.mu * n_i.dot(n_j) * Mat3::Identity() + lame.mu * n_j * n_i.transpose();
  return rest.fill / (9 * rest.volume) * (Q * core * Q.transpose());
}

Mat3 rotation_differential(const Mat3& Q, const Mat3& F, const Mat3& dF) {
  const Mat3 S = symmetric_part(Q.transpose() * F);
  Mat3 A = S.trace() * Mat3::Identity() - S;
  const double scale = S.norm();
  if (!(A.determinant() > 1e-12 * scale * scale * scale)) A += (1e-6 * scale + 1e-300) * Mat3::Identity();
  const Mat3 B = Q.transpose() * dF;
  const Vec3 axial(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
  return Q * cross_matrix(A.inverse() * axial);
}

Mat3 first_piola(const Lame& lame, const Mat3& Q, const Mat3& F, const Mat3& plastic_strain) {
  return Q * isotropic_stress(lame, corotational_strain(Q, F) - plastic_strain);
}

Mat9 first_piola_derivative(const Lame& lame, const Mat3& Q, const Mat3& F, const Mat3& plastic_strain) {
  const Mat3 sigma = isotropic_stress(lame, corotational_strain(Q, F) - plastic_strain);
  Mat9 derivative;
  for (int k = 0; k < 9; ++k) {
    Mat3 dF = Mat3::Zero();
    dF.data()[k] = 1;
    const Mat3 dQ = rotation_differential(Q, F, dF);
    const Mat3 d_strain = symmetric_part(dQ.transpose() * F + Q.transpose() * dF);
    const Mat3 dP = dQ * sigma + Q * isotropic_stress(lame, d_strain);
    derivative.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data());
  }
  return derivative;
}

Mat12 exact_stiffness(const RestTet& rest, const Lame& lame, const Mat34& x, const Mat3& Q,
                      const Mat3& plastic_strain) {
  const Mat3 F = deformation_gradient(x, rest.beta), F_clamped = deformation_gradient(x, rest.beta_clamped);
  const Mat3 sigma = isotropic_stress(lame, corotational_strain(rest, x, Q) - plastic_strain);
  Mat12 K;
  for (int k = 0; k < 12; ++k) {
    Mat34 dx = Mat34::Zero();
    dx.data()[k] = 1;
    const Mat3 dQ = rotation_differential(Q, F, deformation_gradient(dx, rest.beta));
    const Mat3 d_strain =
        symmetric_part(dQ.transpose() * F_clamped + Q.transpose() * deformation_gradient(dx, rest.beta_clamped));
    const Mat3 dP = dQ * sigma + Q * isotropic_stress(lame, d_strain);
    const Mat34 df = rest.fill / 3 * (dP * rest.normals);
    K.col(k) = -Eigen::Map<const Eigen::Matrix<double, 12, 1>>(df.data());
  }
  return K;
}

}  // namespace crumple::sim::fem
