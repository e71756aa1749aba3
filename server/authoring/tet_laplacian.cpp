#include "server/authoring/tet_laplacian.h"

#include <algorithm>

namespace crumple::authoring {
namespace {

constexpr double kFlattest = 0.01;  // of the longest edge

using EdgeLengths = std::array<double, 6>;

EdgeLengths edge_lengths(const Mat34& x) {
  return {(x.col(1) - x.col(0)).norm(), (x.col(2) - x.col(0)).norm(), (x.col(3) - x.col(0)).norm(),
          (x.col(2) - x.col(1)).norm(), (x.col(3) - x.col(1)).norm(), (x.col(3) - x.col(2)).norm()};
}

}  // namespace

sim::fem::RestTet laplacian_tet(const sim::TetMesh& mesh, int t) {
  const Mat34 X = sim::rest_corners(mesh, t);
  const double limit = 1 / (kFlattest * std::ranges::max(edge_lengths(X)));
  return sim::fem::make_rest_tet(X, limit, mesh.fill.empty() ? 1 : mesh.fill[t]);
}

TetLaplacian tet_laplacian(const sim::TetMesh& mesh) {
  const int n = mesh.node_count();
  TetLaplacian out{Eigen::SparseMatrix<double>(n, n), Eigen::VectorXd::Zero(n)};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * mesh.tets.size());
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const sim::fem::RestTet rest = laplacian_tet(mesh, t);
    const Eigen::Matrix4d dots = rest.normals.transpose() * rest.normals;  // n_i = -3 V grad N_i
    for (int a = 0; a < 4; ++a) {
      out.M[mesh.tets[t][a]] += rest.fill * rest.volume / 4;
      for (int b = 0; b < 4; ++b)
        entries.emplace_back(mesh.tets[t][a], mesh.tets[t][b], rest.fill * dots(a, b) / (9 * rest.volume));
    }
  }
  out.L.setFromTriplets(entries.begin(), entries.end());
  return out;
}

double mean_edge_length(const sim::TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (const double length : edge_lengths(sim::rest_corners(mesh, t))) sum += length;
  return sum / (6.0 * mesh.tet_count());
}

}  // namespace crumple::authoring
