#include "server/sim/linear_solver/block_sparse_matrix.h"

#include "server/sim/quad.h"

#include <algorithm>
#include <cassert>
#include <functional>

namespace crumple::sim::linear_solver {

namespace {

constexpr int kRowsPerChunk = 64;  // some 3 us

}  // namespace

template <class Scalar>
BlockSparseMatrix<Scalar> BlockSparseMatrix<Scalar>::from_edges(int node_count, std::span<const std::array<int, 2>> edges,
                                                                std::vector<std::array<int, 2>>* blocks) {
  std::vector<int> row_start(node_count + 1, 0), columns(2 * edges.size());
  for (const auto& [i, j] : edges) ++row_start[i + 1], ++row_start[j + 1];
  for (int i = 0; i < node_count; ++i) row_start[i + 1] += row_start[i];
  std::vector<int> next(row_start.begin(), row_start.end() - 1);
  // Edges ascend: a row's lower columns come first, from edges that it is second in, then its upper ones.
  if (blocks) blocks->resize(edges.size());
  const auto fill = [&](int row_of, int column_of) {
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const int block = next[edges[e][row_of]]++;
      columns[block] = edges[e][column_of];
      if (blocks) (*blocks)[e][row_of] = block;
    }
  };
  fill(1, 0);
  fill(0, 1);
  return from_pattern(std::move(row_start), std::move(columns));
}

template <class Scalar>
BlockSparseMatrix<Scalar> BlockSparseMatrix<Scalar>::from_pattern(std::vector<int> row_start, std::vector<int> columns) {
  BlockSparseMatrix matrix;
  matrix.values_.assign(9 * columns.size() + 1, Scalar(0));
  matrix.diagonal_.assign(row_start.size() - 1, Mat3::Zero());
  matrix.pattern_ = std::make_shared<const BlockPattern>(std::move(row_start), std::move(columns));
  return matrix;
}

template <class Scalar>
int BlockSparseMatrix<Scalar>::find(int row, int col) const {
  assert(row >= 0 && row < rows());
  const auto& [row_start, columns] = *pattern_;
  const auto begin = columns.begin() + row_start[row], end = columns.begin() + row_start[row + 1];
  const auto it = std::lower_bound(begin, end, col);
  return it != end && *it == col ? static_cast<int>(it - columns.begin()) : -1;
}

template <class Scalar>
Mat3 BlockSparseMatrix<Scalar>::at(int row, int col) const {
  if (row == col) return diagonal_[row];
  const int k = find(row, col);
  return k < 0 ? Mat3::Zero() : Mat3(block(k).template cast<double>());
}

template <class Scalar>
void BlockSparseMatrix<Scalar>::set_zero() {
  std::fill(values_.begin(), values_.end(), Scalar(0));
  std::fill(diagonal_.begin(), diagonal_.end(), Mat3::Zero());
}

template <class Scalar>
void BlockSparseMatrix<Scalar>::multiply_rows(int begin, int end, const double* x, double* y) const {
  const auto& [row_start, columns] = *pattern_;
  for (int row = begin; row < end; ++row) {
    // One sum a column of the blocks: three short dependency chains instead of one long one.
    // The fourth lane carries the next column's first entry along and is never read.
    const double* D = diagonal_[row].data();
    const double* x_row = x + 3 * row;
    Quad sum0 = load_four(D) * x_row[0], sum1 = load_four(D + 3) * x_row[1], sum2 = load_three(D + 6) * x_row[2];
    for (int k = row_start[row]; k < row_start[row + 1]; ++k) {
      const Scalar* B = values_.data() + 9 * k;
      const double* x_k = x + 3 * columns[k];
      sum0 = multiply_add(load_four(B), quad(x_k[0]), sum0);
      sum1 = multiply_add(load_four(B + 3), quad(x_k[1]), sum1);
      sum2 = multiply_add(load_four(B + 6), quad(x_k[2]), sum2);
    }
    store_three(sum0 + sum1 + sum2, y + 3 * row);
  }
}

template <class Scalar>
void BlockSparseMatrix<Scalar>::multiply(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> y,
                                         const ThreadPool& pool) const {
  assert(x.size() == 3 * rows() && y.size() == x.size() && (x.size() == 0 || x.data() != y.data()));
  const auto rows_of = [&](int begin, int end) { multiply_rows(begin, end, x.data(), y.data()); };
  pool.for_chunks(rows(), kRowsPerChunk, std::cref(rows_of));
}

template <class Scalar>
Eigen::SparseMatrix<double> BlockSparseMatrix<Scalar>::to_sparse() const {
  const auto& [row_start, columns] = *pattern_;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * (columns.size() + diagonal_.size()));
  const auto add = [&](int row, int col, const Mat3& B) {
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) entries.emplace_back(3 * row + i, 3 * col + j, B(i, j));
  };
  for (int row = 0; row < rows(); ++row) {
    add(row, row, diagonal_[row]);
    for (int k = row_start[row]; k < row_start[row + 1]; ++k) add(row, columns[k], block(k).template cast<double>());
  }
  Eigen::SparseMatrix<double> matrix(3 * rows(), 3 * rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template class BlockSparseMatrix<float>;
template class BlockSparseMatrix<double>;

}  // namespace crumple::sim::linear_solver
