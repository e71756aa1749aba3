#pragma once

#include "common/types.h"
#include "server/sim/fem/linear_tetrahedron.h"

// The co-rotated linear isotropic law of Parker & O'Brien 2009, section 3. Strain and stress are in the element's
// unrotated axes; Q turns them into world axes: sigma_world = Q sigma Q^T.
namespace crumple::sim::fem {

using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat12 = Eigen::Matrix<double, 12, 12>;

struct Lame {
  double lambda = 0, mu = 0;  // [Pa]
};
// lambda = E nu / ((1 + nu)(1 - 2 nu)), mu = E / (2 (1 + nu)).
Lame lame_constants(double young, double poisson);

inline Mat3 symmetric_part(const Mat3& A) { return 0.5 * (A + A.transpose()); }

// eps~ = sym(Q^T F) - I.
inline Mat3 corotational_strain(const Mat3& Q, const Mat3& F) {
  return symmetric_part(Q.transpose() * F) - Mat3::Identity();
}
// The same with a clamped basis: sym((Q^T D_x - D_u) beta'). x: node positions in the columns.
Mat3 corotational_strain(const RestTet& rest, const Mat34& x, const Mat3& Q);

// sigma = lambda tr(eps) I + 2 mu eps.
inline Mat3 isotropic_stress(const Lame& lame, const Mat3& strain) {
  return lame.lambda * strain.trace() * Mat3::Identity() + 2 * lame.mu * strain;
}

// lambda/2 tr(eps)^2 + mu eps : eps [J/m^3].
inline double energy_density(const Lame& lame, const Mat3& strain) {
  const double trace = strain.trace();
  return 0.5 * lame.lambda * trace * trace + lame.mu * strain.squaredNorm();
}

// The same of the stress that the strain has: sigma : eps / 2, eps = (sigma - lambda / (3 lambda + 2 mu) tr(sigma) I) / (2 mu).
inline double energy_density_of_stress(const Lame& lame, const Mat3& sigma) {
  const double share = lame.lambda / (3 * lame.lambda + 2 * lame.mu), trace = sigma.trace();
  return (sigma.squaredNorm() - share * trace * trace) / (4 * lame.mu);
}

// sqrt(3/2 s : s) with s the deviator of sigma [Pa].
double von_mises(const Mat3& sigma);

// f_i = Q sigma n_i / 3 in the columns [N], times the tet's fill. With the rotation of F in Q this is -dE/dx as long as
// stress and stretch commute: always for elastic, unclamped tets under the polar or SVD rule. (The paper prints no
// 1/3.)
Mat34 nodal_forces(const RestTet& rest, const Mat3& Q, const Mat3& sigma);

// The antisymmetric A with (sigma + A) S symmetric, S = sym(Q^T F): forces of Q (sigma + A) have no moment about anything
// and are -dE/dx exactly, plastic strain or not (of unclamped tets, Q the rotation of F). Zero where stress and stretch
// commute; with a plastic strain that is not coaxial they do not, and forces of Q sigma alone turn a free body for ever.
//   A S + S A = S sigma - sigma S, so (tr(S) I - S) a = axial(S sigma - sigma S)
// Where that matrix is nearly singular, in tets squashed to nothing or inverted, A fades to zero.
Mat3 moment_balance(const Mat3& S, const Mat3& sigma);
// The same of a given right-hand side: A of (tr(S) I - S) a = axial.
Mat3 moment_balance(const Mat3& S, const Vec3& axial);
inline constexpr double kBalanceFades = 0.5;  // below this determinant; 8 at rest, 0 where two signed stretches cancel

// K_ij = -J_ij, J_ij = -1/(9V) Q (lambda n_i n_j^T + mu (n_i . n_j) I + mu n_j n_i^T) Q^T (eq. 2 with the factor that
// the paper does not print), times fill: -df_i/dx_j with Q held fixed [N/m]. For one tet, by the formula; assembly
// works with its cached factors (RestBody::core).
Mat3 stiffness_block(const RestTet& rest, const Lame& lame, const Mat3& Q, int i, int j);

// dQ of the polar or SVD rotation for a change dF:  Q^T dQ = [w],  (tr(S) I - S) w = axial(Q^T dF - dF^T Q),
// S = Q^T F. Where Q jumps (two smallest signed singular values cancel) there is none; a bounded one is returned.
Mat3 rotation_differential(const Mat3& Q, const Mat3& F, const Mat3& dF);

// First Piola stress P = Q sigma(eps~ - eps^P) [Pa] of an unclamped tet, and its exact derivative d vec(P) / d vec(F),
// dQ/dF included (columns stacked). With eps^P = 0 it is the Hessian of the energy density, hence symmetric.
Mat3 first_piola(const Lame& lame, const Mat3& Q, const Mat3& F, const Mat3& plastic_strain);
Mat9 first_piola_derivative(const Lame& lame, const Mat3& Q, const Mat3& F, const Mat3& plastic_strain);

// -df/dx of all 12 dofs, dQ/dF included, clamped tets too [N/m]; node-major. For Newton's method.
Mat12 exact_stiffness(const RestTet& rest, const Lame& lame, const Mat34& x, const Mat3& Q, const Mat3& plastic_strain);

}  // namespace crumple::sim::fem
