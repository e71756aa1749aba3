#pragma once

#include "common/error.h"
#include "server/sim/example_based/example_set.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace crumple::authoring {

// What an artist asks of a handle. What is not given is found.
struct HandleTarget {
  std::optional<Vec3> position;  // where the handle's point goes [m]
  std::optional<Quat> rotation;  // how it turns, of any length but 0
};

// Those handles that a pose names are where it has them, turned as it has them; the others are free. points: at rest.
std::vector<HandleTarget> targets_of(std::span<const std::optional<sim::example_based::BoneTransform>> pose,
                                     std::span<const Vec3> points);

struct PoseSolverOptions {
  int rotation_groups = 0;  // [0, 4096]; 0: four a handle, at least 16 and at most 256
  double tolerance = 1e-9;  // a sweep that lowers the energy by less than this part of it is the last [-], (0, 0.1]
  int max_sweeps = 2000;    // [1, 1000000]
};

// What the solve did.
struct PoseSolveReport {
  bool converged = false;
  int affine_rounds = 0;         // of the paper's own iteration
  int sweeps = 0;                // with rigid handles
  std::vector<double> energies;  // before the first sweep and after each [m^3]: never rises
  double strain = 0;             // root mean square of |F - R| over the volume [-]
};

struct SolvedPose {
  std::vector<sim::example_based::BoneTransform> bones;  // B
  PoseSolveReport report;
};

// Fast automatic skinning transformations [Jacobson et al. 2012], which algorithm 1 of Jones et al. 2016 poses by: an
// artist moves some handles, all others, and the rotations of those that were moved, are such that the skinned mesh is
// as rigid as possible,
//   minimise  E = 1/2 sum_t fill_t V_t |F_t - R_g(t)|^2   over handle transforms and rotations R_g
// F_t is the deformation gradient of tet t of the skinned mesh x_i = sum_b W_ib T_b u_i; tets share rotations in groups
// of like weights (k-means). Mesh and weights enter through a matrix of 4B x 4B and one of 4B x 3 a group alone, made
// once: a solve costs the same for any mesh.
//
// The paper alternates between the best R_g (a polar factor each) and a linear solve for affine T_b. Examples need
// rigid T_b (a rotation and a translation), so that is the start; rotations of the T_b are taken out, and sweeps go on
// with rigid handles: the best R_g, then the best rotation of each handle in turn (again a polar factor: a rotation
// does not change the quadratic part), then all translations by a linear solve. Each lowers E. The other start is the
// rigid motion that is nearest to the targets, and whichever has less energy is taken.
class PoseSolver {
 public:
  // W: N x B; points: B, where the handles are at rest [m] (of a bone: any of its points). Errors: an invalid mesh,
  // points that are not finite or of another number, options out of range. W must be the mesh's.
  static Result<PoseSolver> make(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, std::span<const Vec3> points,
                                 const PoseSolverOptions& options = {});

  int handle_count() const { return static_cast<int>(points_.size()); }
  int group_count() const { return static_cast<int>(K_.cols()) / 3; }

  // targets: B. With no position given the body stays where it is; with nothing given the pose is the rest pose. A
  // handle that moves nothing but its own point, which no pose can turn, turns with the rigid motion nearest to the
  // targets. Errors: another number of targets, values that are not finite, a rotation of length 0.
  Result<SolvedPose> solve(std::span<const HandleTarget> targets, const std::string& field = "targets") const;

 private:
  class Problem;
  PoseSolver() = default;

  PoseSolverOptions options_;
  std::vector<Vec3> points_;
  double volume_ = 0;    // sum of fill V [m^3]
  double constant_ = 0;  // of E [m^3]
  Eigen::MatrixXd A_;    // 4B x 4B: M^T L M, columns of M: W_ib (u_i - p_b), W_ib
  Eigen::MatrixXd K_;    // 4B x 3 groups: T^T K_g = sum over tets of fill V F
};

}  // namespace crumple::authoring
