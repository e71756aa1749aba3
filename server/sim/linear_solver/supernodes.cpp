#include "server/sim/linear_solver/supernodes.h"

#include <algorithm>

namespace crumple::sim::linear_solver {
namespace {

// Row ids of column j, the diagonal's first.
std::span<const int> rows_of(const Eigen::SparseMatrix<double>& L, int j) {
  return {L.innerIndexPtr() + L.outerIndexPtr()[j], L.innerIndexPtr() + L.outerIndexPtr()[j + 1]};
}

// The first column after j that has other rows below it than j and those between.
int end_of(const Eigen::SparseMatrix<double>& L, int j) {
  int end = j + 1;
  while (end < L.cols() && std::ranges::equal(rows_of(L, end), rows_of(L, end - 1).subspan(1))) ++end;
  return end;
}

}  // namespace

std::vector<Supernode> supernodes(const Eigen::SparseMatrix<double>& L) {
  std::vector<Supernode> all;
  for (int j = 0, end = 0; j < L.cols(); j = end) {
    end = end_of(L, j);
    all.push_back({j, end - j, rows_of(L, end - 1).subspan(1)});
  }
  return all;
}

std::span<const double> own_values(const Eigen::SparseMatrix<double>& L, const Supernode& s, int c) {
  return {L.valuePtr() + L.outerIndexPtr()[s.first + c], static_cast<std::size_t>(s.width - c)};
}

std::span<const double> below_values(const Eigen::SparseMatrix<double>& L, const Supernode& s, int c) {
  return {L.valuePtr() + L.outerIndexPtr()[s.first + c + 1] - s.below.size(), s.below.size()};
}

}  // namespace crumple::sim::linear_solver
