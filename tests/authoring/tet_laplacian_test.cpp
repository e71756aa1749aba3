#include "server/authoring/tet_laplacian.h"

#include "tests/authoring/handles_for_tests.h"

namespace crumple::authoring {
namespace {

using sim::TetMesh;

TEST(TetLaplacian, OfASquaredDistanceIsMinusSix) {
  const TetMesh mesh = *centred_box_mesh({1, 1, 1}, {6, 6, 6}, Lattice::bcc);
  const auto [L, M] = tet_laplacian(mesh);
  Eigen::VectorXd squared(mesh.node_count());
  for (int i = 0; i < mesh.node_count(); ++i) squared[i] = mesh.X[i].squaredNorm();
  const Eigen::VectorXd laplacian = -(L * squared).cwiseQuotient(M);
  double sum = 0;
  int inside = 0;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (mesh.X[i].cwiseAbs().maxCoeff() < 0.3) sum += laplacian[i], ++inside;
  EXPECT_GT(inside, 50);
  EXPECT_NEAR(sum / inside, 6, 1e-9);
  EXPECT_NEAR(M.sum(), 1, 1e-12);
  EXPECT_LT((L * Eigen::VectorXd::Ones(mesh.node_count())).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(TetLaplacian, PartlyFilledTetsCountByWhatIsFilled) {
  TetMesh mesh = bar(4, 0.25);
  const TetLaplacian full = tet_laplacian(mesh);
  mesh.fill.assign(mesh.tets.size(), 0.3);
  const TetLaplacian partly = tet_laplacian(mesh);
  EXPECT_LT((partly.L - 0.3 * full.L).norm(), 1e-14);
  EXPECT_LT((partly.M - 0.3 * full.M).norm(), 1e-14);
}

}  // namespace
}  // namespace crumple::authoring
