#pragma once

#include "common/types.h"
#include "server/sim/parallel_for.h"
#include "server/sim/quad.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// Where a matrix has off-diagonal blocks.
struct BlockPattern {
  std::vector<int> row_start{0};  // one more than there are rows: blocks of a row
  std::vector<int> columns;       // one a block, ascending in a row
  bool operator==(const BlockPattern&) const = default;
};

// A square matrix of 3x3 blocks, one block row ("noderow") a node, row-compressed; the full matrix is stored although
// it is symmetric, since the product is what it is for (Parker & O'Brien 2009, section 4).
//
// Scalar is the precision of the off-diagonal blocks: float halves the traffic of a product. Diagonal blocks are double
// in either case: they hold the mass and minus the sum of their row's stiffness, and rounding that to float would make
// a rigid translation of a stiff body (E = 1e9) cost 1 % of its momentum. Explicit instances: float and double.
template <class Scalar>
class BlockSparseMatrix {
 public:
  using Block = Eigen::Map<const Eigen::Matrix<Scalar, 3, 3>>;

  BlockSparseMatrix() : pattern_(std::make_shared<const BlockPattern>()) {}

  // The pattern of a mesh: a block for every edge both ways, all zero. Nodes without an edge keep their diagonal block.
  // edges: pairs of nodes in [0, node_count), first < second, ascending, none twice.
  // blocks: if given, of each edge (i, j) the indices of its blocks (i, j) and (j, i).
  static BlockSparseMatrix from_edges(int node_count, std::span<const std::array<int, 2>> edges,
                                      std::vector<std::array<int, 2>>* blocks = nullptr);
  // A given symmetric pattern, all zero. columns: ascending in a row, no diagonal.
  static BlockSparseMatrix from_pattern(std::vector<int> row_start, std::vector<int> columns);

  int rows() const { return static_cast<int>(diagonal_.size()); }        // block rows
  int block_count() const { return static_cast<int>(columns().size()); }  // off-diagonal blocks
  std::span<const int> row_start() const { return pattern_->row_start; }
  std::span<const int> columns() const { return pattern_->columns; }
  // Matrices that have the same one have the same pattern; whoever keeps it can tell whether a matrix still has it.
  const std::shared_ptr<const BlockPattern>& pattern() const { return pattern_; }
  const std::vector<Mat3>& diagonal() const { return diagonal_; }        // one a row
  std::vector<Mat3>& diagonal() { return diagonal_; }

  // Index of the off-diagonal block (row, col), -1 where the pattern has none. O(log row length).
  int find(int row, int col) const;
  Block block(int k) const { return Block(values_.data() + 9 * k); }
  const Scalar* values() const { return values_.data(); }  // 9 a block, column-major; one more number may be read
  template <class Derived>
  void set_block(int k, const Eigen::MatrixBase<Derived>& value) {
    Eigen::Map<Eigen::Matrix<Scalar, 3, 3>>(values_.data() + 9 * k) = value.template cast<Scalar>();
  }
  void set_block(int k, const Quad (&columns)[3]) {  // the fourth lanes are not read
    store_three(columns[0], values_.data() + 9 * k);
    store_three(columns[1], values_.data() + 9 * k + 3);
    store_three(columns[2], values_.data() + 9 * k + 6);
  }
  Mat3 at(int row, int col) const;  // the block, diagonal included; zero outside the pattern
  void set_zero();

  // y = A x; x, y: 3 rows(), node-major, not the same array. Products and sums are double; each row is one thread's, so
  // the bits do not depend on the number of threads.
  void multiply(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> y, const ThreadPool& pool) const;
  void multiply_rows(int begin, int end, const double* x, double* y) const;  // those block rows of y alone

  // The same matrix entry by entry, both triangles.
  Eigen::SparseMatrix<double> to_sparse() const;

 private:
  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<Scalar> values_;  // 9 a block, column-major, and one more: products load four at a time
  std::vector<Mat3> diagonal_;
};

extern template class BlockSparseMatrix<float>;
extern template class BlockSparseMatrix<double>;

}  // namespace crumple::sim::linear_solver
