#pragma once

#include "server/sim/fem/linear_tetrahedron.h"
#include "server/sim/mesh/tet_mesh.h"

#include <Eigen/SparseCore>

namespace crumple::authoring {

// The Laplacian of linear tets and their lumped masses:
//   L_ij = sum_t fill_t V_t grad N_i . grad N_j  [m],    M_i = sum_t fill_t V_t / 4  [m^3],
// so that M^-1 L w is minus the Laplacian of w, L is positive semi-definite and annuls constants. A tet that is partly
// empty (TetMesh::fill) counts by what is filled, in both: their quotient stays that of the solid. Gradients of a tet
// flatter than a hundredth of its longest edge are clamped as in fem/linear_tetrahedron.h, so that slivers do not spoil
// the condition. Nodes of no tet have empty rows and no mass.
struct TetLaplacian {
  Eigen::SparseMatrix<double> L;  // node_count x node_count, both triangles
  Eigen::VectorXd M;              // node_count
};
TetLaplacian tet_laplacian(const sim::TetMesh& mesh);

// Tet t with its gradients as the Laplacian has them.
sim::fem::RestTet laplacian_tet(const sim::TetMesh& mesh, int t);

// Mean length of the tets' edges, each counted once a tet [m].
double mean_edge_length(const sim::TetMesh& mesh);

}  // namespace crumple::authoring
