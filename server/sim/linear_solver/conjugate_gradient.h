#pragma once

#include "server/sim/parallel_for.h"

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace crumple::sim::linear_solver {

// out = (linear map) in; both have the size of the system and are never the same vector. Give a large lambda as
// std::cref(lambda): a std::function of a reference does not allocate.
using LinearMap = std::function<void(const Eigen::VectorXd& in, Eigen::VectorXd& out)>;

// Blocks [begin, end) of three entries of a map that is block diagonal.
using BlockMap = std::function<void(int begin, int end, const Eigen::VectorXd& in, Eigen::VectorXd& out)>;

// A linear map that returns in . out, found on the way.
using DotMap = std::function<double(const Eigen::VectorXd& in, Eigen::VectorXd& out)>;

// A squared norm of a residual, for SolveReport.
using SquaredNorm = std::function<double(const Eigen::VectorXd& r)>;

struct SolveOptions {
  double tolerance = 1e-3;  // relative, see SolveReport
  int max_iterations = 400;
  // P^-1 is near A^-1, and dear: b . x, which is b . A^-1 b when x is there, stands for |b|^2, so that P^-1 is not applied to b.
  // The residual is infinite where the solve ends at x = 0.
  bool near_inverse = false;
  bool has_residual = false;  // workspace.r is b - A x already
};

// residual: |b - A x| / |b| in the norm of the preconditioner, |r| = sqrt(r . P^-1 r), or in the one given. It weighs light and heavy nodes,
// and rows of different units (a rigid body's force and torque), on one scale. As in every conjugate gradient method it
// is the recurrence's residual; the true one stops falling at round-off. NaN where b is not finite.
struct SolveReport {
  int iterations = 0;
  double residual = 0;
  bool converged = false;
};

// Vectors of a solve; kept by the caller, so that repeated solves of one size do not allocate.
struct CgWorkspace {
  Eigen::VectorXd r, z, p, Ap;
  std::vector<double> partial_sums;  // one a chunk
  void resize(Eigen::Index size);
};

// Preconditioned conjugate gradients (Shewchuk 1994) for symmetric positive definite A, from the guess in x.
// An entry of x that already solves its own row and is coupled to no other keeps its bits: prescribed nodes stay exact.
// Ends at the tolerance; at the cap; when the residual found no new low in kStagnationWindow iterations or is
// kDivergence times above it; or when a product shows that A or P is not positive definite or not finite. x is finite
// on return whenever the guess was. b = 0 gives x = 0. Sums run over fixed chunks: the bits do not depend on the number
// of threads. For fewer loops, each of which threads wait for: precondition_blocks, P^-1 once more where it is block diagonal, which is
// then applied in the loop that makes the residual; apply_and_dot, A once more.
inline constexpr int kStagnationWindow = 250;
inline constexpr double kDivergence = 1e8;
SolveReport conjugate_gradient(const LinearMap& apply, const LinearMap& precondition, const Eigen::VectorXd& b,
                               Eigen::VectorXd& x, const SolveOptions& options, CgWorkspace& workspace,
                               const ThreadPool& pool, const SquaredNorm& norm = {}, const BlockMap& precondition_blocks = {},
                               const DotMap& apply_and_dot = {});

}  // namespace crumple::sim::linear_solver
