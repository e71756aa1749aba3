#pragma once

#include "server/authoring/handles.h"

namespace crumple::authoring {

struct BiharmonicOptions {
  double tolerance = 1e-4;                // of the stopping rule [-], (0, 0.1]
  int max_iterations = 500;               // [1, 100000]
  double reach = 0;                       // of prescribed_weights [m], >= 0
  const sim::ThreadPool* pool = nullptr;  // null: the calling thread alone; the same bits either way
};

// What the solve did.
struct BiharmonicReport {
  bool converged = false;
  int iterations = 0;
  int factors = 0;             // numeric factorisations of the system; the symbolic one is done once
  double primal_residual = 0;  // root mean square of X - Z over all entries [-]
  double dual_residual = 0;    // root mean square of the last change of Z [-]
  double energy = 0;           // of W [1/m]
  double relaxed_energy = 0;   // of X, which leaves the simplex by the primal residual: near the optimum, below it
  int components = 0;          // parts of the mesh that share no vertex
  int components_without_handle = 0;
  int shared_vertices = 0;  // of prescribed_weights
};

struct BiharmonicWeights {
  Eigen::MatrixXd W;  // N x B
  BiharmonicReport report;
};

// Bounded biharmonic weights [Jacobson et al. 2011] of a tet mesh's vertices:
//   minimise  sum_b 1/2 w_b^T (L M^-1 L) w_b    with W >= 0, rows of W that sum to 1, and W as prescribed at handles
// (L, M: tet_laplacian.h; prescribed_weights: handles.h). All rows of W are in the simplex to rounding, converged or
// not. The sum to 1 is a constraint of the optimum here, where the authors solve each column alone and normalise.
//
// Solved by the alternating direction method of multipliers with over-relaxation 1.7: X minimises the energy plus
// rho/2 |X - Z + U|^2 in the norm of the energy's own diagonal, Z is the row-wise projection of X + U to the simplex.
// The system is factored once for all columns, and again (three times at most) where the residuals are out of balance
// by five. It starts from the unbounded biharmonic weights. Stopped when both residuals are at most `tolerance`.
//
// A part of the mesh without a handle moves as one with the vertex nearest to it: all its rows are that vertex's. So
// does a vertex of no tet. Errors: an invalid mesh (flipped or flat tets, ...), prescribed_weights', options out of
// range, a mesh so badly shaped that the system cannot be factored.
Result<BiharmonicWeights> bounded_biharmonic_weights(const sim::TetMesh& mesh, const Handles& handles,
                                                     const BiharmonicOptions& options = {});

}  // namespace crumple::authoring
