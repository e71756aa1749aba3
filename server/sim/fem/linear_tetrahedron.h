#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::sim::fem {

// Rest data of one linear tetrahedron (Parker & O'Brien 2009, section 3).
//
// A badly shaped tet has a basis matrix with large singular values, hence large stiffness. Those above a limit are set
// to it (after Iben & O'Brien 2006), which gives beta'. Rotation comes from the true F = D_x beta; strain is
// sym((Q^T D_x - D_u) beta'), zero at rest; the node gradients, and with them n_i, come from beta'; volume is the true
// one.
struct RestTet {
  Mat3 beta = Mat3::Identity();           // D_u^-1, eq. 1 [1/m]
  Mat3 beta_clamped = Mat3::Identity();   // beta' [1/m]; beta where nothing is clamped
  Mat3 rest_gradient = Mat3::Identity();  // D_u beta' [-]; I where nothing is clamped
  Mat34 normals = Mat34::Zero();          // n_i: outward, length = area of the face opposite node i, rest axes [m^2]
  double volume = 0;                      // V [m^3]
  double fill = 1;                        // fraction that is material: weighs mass and stiffness [-]
  bool clamped = false;
};

// X: rest positions in the columns, positive volume. clamp_limit [1/m], infinity: never clamp.
RestTet make_rest_tet(const Mat34& X, double clamp_limit, double fill = 1);

// n_i of a tet of that volume and basis matrix (beta' where there is one).
Mat34 area_weighted_normals(const Mat3& beta, double volume);

// D_x (or D_u, D_v): columns x_2 - x_1, x_3 - x_1, x_4 - x_1.
inline Mat3 edge_matrix(const Mat34& x) { return x.rightCols<3>().colwise() - x.col(0); }

// F = D_x beta; with velocities in place of positions G = D_v beta (eq. 1).
inline Mat3 deformation_gradient(const Mat34& x, const Mat3& beta) { return edge_matrix(x) * beta; }

// The four columns of a tet out of a node array.
inline Mat34 gather(const std::vector<Vec3>& nodes, const Tet& tet) {
  Mat34 columns;
  for (int a = 0; a < 4; ++a) columns.col(a) = nodes[tet[a]];
  return columns;
}

}  // namespace crumple::sim::fem
