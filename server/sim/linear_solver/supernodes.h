#pragma once

#include <Eigen/SparseCore>

#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// Columns first .. first + width - 1 of a Cholesky factor that have the same rows below the last of them: with these rows they
// are one dense trapezoid.
struct Supernode {
  int first = 0, width = 0;
  std::span<const int> below;  // rows, ascending; of L
};

// Of L, lower triangular, rows of a column ascending: all of its columns, in order.
std::vector<Supernode> supernodes(const Eigen::SparseMatrix<double>& L);

// Values of column first + c: of the supernode's own rows, from the diagonal down; of the rows below.
std::span<const double> own_values(const Eigen::SparseMatrix<double>& L, const Supernode& s, int c);
std::span<const double> below_values(const Eigen::SparseMatrix<double>& L, const Supernode& s, int c);

}  // namespace crumple::sim::linear_solver
