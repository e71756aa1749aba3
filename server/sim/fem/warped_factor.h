#pragma once

#include "server/sim/fem/assembly.h"
#include "server/sim/linear_solver/supernodal_solve.h"
#include "server/sim/mesh/node_stars.h"

#include <memory>
#include <vector>

namespace crumple::sim::fem {

// Preconditioner z = R (L L^T)^-1 R^T r of a body whose tets stay as they are: L L^T is the Cholesky factor of the step's matrix as
// it would be with every node at rest, R a rotation a node, the mean of those of some of the elements around it. Where a piece has
// only turned that is the matrix itself; where it is bent, nearly: the elements of a node turn almost alike. R is a rotation
// whatever the elements do, inverted ones too, so that the map stays symmetric positive definite.
// A factor is made once for each formula (dt, integrator) and set of prescribed nodes, and the last kMostKept are kept. What is kept
// is a function of rest data alone: a step does not depend on steps before it.
class WarpedFactor {
 public:
  static constexpr std::size_t kMostKept = 2;  // backward Euler and BDF2

  // For an assembled system of the body. X: rest positions. False: the matrix at rest has no factor; nothing may be applied then.
  bool update(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system, const ThreadPool& pool);

  // What update() makes if it is not there, for a system of this scale: beforehand, since making one takes as long as hundreds of steps.
  void make(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system, const StepSystem::Scale& scale,
            const ThreadPool& pool);
  bool has(const StepSystem& system) const;  // update() has nothing to make, and is true

  // r, z: 3n, node-major; segments of longer vectors are welcome.
  void apply(Eigen::Ref<const Eigen::VectorXd> r, Eigen::Ref<Eigen::VectorXd> z, const ThreadPool& pool);

  const std::vector<Mat3>& rotations() const { return R_; }  // one a node
  int factored() const { return factored_; }  // how often a factor was made

 private:
  struct Kept {
    StepSystem::Scale scale;
    std::vector<char> prescribed;
    bool is_of(const StepSystem::Scale& of, const std::vector<char>& held) const { return scale == of && prescribed == held; }
    bool usable = false;
    linear_solver::SupernodalSolve solve;
  };
  void find_rotations(const RestBody& rest, const StepSystem& system, const ThreadPool& pool);

  std::shared_ptr<const linear_solver::BlockPattern> pattern_;  // of all that is kept; an assembly makes another when tets are others
  NodeStars stars_;         // of the tets that it is of
  std::vector<Kept> kept_;  // the last one is in use
  std::vector<Mat3> R_;
  Eigen::VectorXd turned_;
  int factored_ = 0;
};

}  // namespace crumple::sim::fem
