#include "server/sim/fem/linear_tetrahedron.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <cassert>

namespace crumple::sim::fem {

namespace {

// beta' = U min(S, limit) V^T.
Mat3 clamp_singular_values(const Mat3& beta, double limit) {
  const Eigen::JacobiSVD<Mat3> svd(beta, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.singularValues().cwiseMin(limit).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

// The rows of beta' are the gradients of the shape functions of nodes 2 to 4, and n_i = -3 V grad N_i.
Mat34 area_weighted_normals(const Mat3& beta, double volume) {
  Mat34 normals;
  normals.rightCols<3>() = -3 * volume * beta.transpose();
  normals.col(0) = -normals.rightCols<3>().rowwise().sum();
  return normals;
}

RestTet make_rest_tet(const Mat34& X, double clamp_limit, double fill) {
  const Mat3 D_u = edge_matrix(X);
  RestTet tet;
  tet.volume = D_u.determinant() / 6;
  assert(tet.volume > 0 && clamp_limit > 0 && fill > 0 && fill <= 1);
  tet.beta = D_u.inverse();
  tet.fill = fill;
  // The Frobenius norm bounds the largest singular value: most tets need no decomposition.
  tet.clamped = tet.beta.norm() > clamp_limit && Eigen::JacobiSVD<Mat3>(tet.beta).singularValues()(0) > clamp_limit;
  tet.beta_clamped = tet.clamped ? clamp_singular_values(tet.beta, clamp_limit) : tet.beta;
  if (tet.clamped) tet.rest_gradient = D_u * tet.beta_clamped;
  tet.normals = area_weighted_normals(tet.beta_clamped, tet.volume);
  return tet;
}

}  // namespace crumple::sim::fem
