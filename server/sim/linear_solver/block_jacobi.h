#pragma once

#include "common/types.h"
#include "server/sim/parallel_for.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// Preconditioner z = D^-1 r with D the 3x3 diagonal blocks of a matrix. Filled in two strokes, so that others (contact
// rows, neighbours of rigid bodies) can add to the blocks in between:
//   jacobi.assign(A.diagonal());  jacobi.blocks()[node] += ...;  jacobi.invert(pool);
class BlockJacobi {
 public:
  void assign(std::span<const Mat3> diagonal);  // copies; allocates only when the number of blocks grows
  std::vector<Mat3>& blocks() { return blocks_; }

  // Replaces each block by its inverse. A block that is not positive definite (or not finite) is replaced by the
  // identity: the preconditioner stays positive definite whatever the matrix is.
  void invert(const ThreadPool& pool);

  // z = D^-1 r, after invert(); r, z: 3 a block, node-major.
  void apply(Eigen::Ref<const Eigen::VectorXd> r, Eigen::Ref<Eigen::VectorXd> z, const ThreadPool& pool) const;
  void apply_blocks(int begin, int end, const double* r, double* z) const;  // those of z alone
  double squared_norm(const Eigen::VectorXd& r, const ThreadPool& pool) const;  // r . D^-1 r; one call at a time

 private:
  std::vector<Mat3> blocks_;
  mutable std::vector<double> partial_;  // scratch of squared_norm, one a chunk
};

}  // namespace crumple::sim::linear_solver
