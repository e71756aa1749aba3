#pragma once

#include "server/lab/stability/soft_trial.h"

// Steps of a SoftTrial: the core's, and what it is compared with.
namespace crumple::lab::stability {

// The core's step: linearised backward Euler, conjugate gradients with block-Jacobi (Parker & O'Brien 2009, eq. 5).
sim::linear_solver::SolveReport backward_euler(SoftTrial& trial, double dt);

// The core's other step: BDF2 linearised at the predicted position, backward Euler where a tet is near inversion.
sim::linear_solver::SolveReport bdf2(SoftTrial& trial, double dt);

// Backward Euler's system as an island of one body, solved by the core's multigrid, or directly.
sim::linear_solver::SolveReport backward_euler_multigrid(SoftTrial& trial, double dt);
sim::linear_solver::SolveReport backward_euler_direct(SoftTrial& trial, double dt);

// The same equations, assembled here from the core's element formulas with the method's rotation, whatever its
// determinant; solved directly. For rules that the core does not have.
sim::linear_solver::SolveReport backward_euler_any_rotation(SoftTrial& trial, double dt);

// v += dt f(x) / m, x += dt v, over the core's forces. Stable below 2 / omega_max only.
sim::linear_solver::SolveReport symplectic_euler(SoftTrial& trial, double dt);

// U V^T of the SVD F = U D V^T as it comes: a mirrored F has a mirrored Q (det Q = -1), which makes the mirror image a
// rest shape.
Mat3 plain_polar_rotation(const Mat3& F);

}  // namespace crumple::lab::stability
