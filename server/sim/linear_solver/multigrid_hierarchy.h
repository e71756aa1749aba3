#pragma once

#include "server/sim/linear_solver/galerkin_product.h"

#include <memory>
#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// The coarse levels of one body: lattices over its rest shape, each twice as wide as the one before, and Galerkin
// operators on them. Level 0 is the body's own matrix, of which a copy in single precision is kept if it is in double.
// Structure is a function of topology and held nodes, values of the matrix, alone, so that a step does not depend on steps before it: after a split what is far from it is taken over, which
// is what making it anew would give, bit for bit.
class MultigridHierarchy {
 public:
  struct Level {
    LevelTransfer transfer;       // from the next finer level
    GalerkinProduct product;
    BlockSparseMatrix<float> A;
  };

  // Brings the levels up to date if the matrix has another pattern or other nodes are held, and computes their operators.
  // X: rest positions; held: prescribed nodes, whose rows of A are struck; mean_tet_volume [m^3].
  template <class Scalar>
  void update(const BlockSparseMatrix<Scalar>& A, std::span<const Vec3> X, std::span<const char> held, double mean_tet_volume,
              const ThreadPool& pool);

  const std::vector<Level>& levels() const { return levels_; }
  const float* finest() const { return values_; }  // values() of A in single precision, as of the last update; of A itself if it has that

 private:
  void follow(const std::shared_ptr<const BlockPattern>& pattern, std::span<const Vec3> X, std::span<const char> held,
              double mean_tet_volume);

  std::vector<Level> levels_;
  std::vector<float> finest_;
  const float* values_ = nullptr;  // A's own or finest_; until the next update, or until A is assembled anew
  // What they were made of.
  std::vector<char> held_;
  std::vector<Vec3> X_;
  std::shared_ptr<const BlockPattern> pattern_;
};

extern template void MultigridHierarchy::update(const BlockSparseMatrix<float>&, std::span<const Vec3>, std::span<const char>,
                                                double, const ThreadPool&);
extern template void MultigridHierarchy::update(const BlockSparseMatrix<double>&, std::span<const Vec3>, std::span<const char>,
                                                double, const ThreadPool&);

}  // namespace crumple::sim::linear_solver
