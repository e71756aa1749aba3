#include "server/sim/mesh/embedding.h"

#include "server/sim/mesh/tet_tree.h"
#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple::sim {
namespace {

std::vector<Vec3> random_points(int count, double low, double high) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(low, high);
  std::vector<Vec3> points(count);
  for (Vec3& p : points)
    for (int a = 0; a < 3; ++a) p[a] = coordinate(random);
  return points;
}

Mat34 corners(const TetMesh& mesh, int t) {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = mesh.X[mesh.tets[t][k]];
  return x;
}

TEST(TetTree, DistanceToTheUnitTetIsKnownInEachRegion) {
  Mat34 x;
  x << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(0.2, 0.2, 0.2)), 0);
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(0, 0, 0)), 0);
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(0.2, 0.2, -0.5)), 0.25);     // over a face
  EXPECT_NEAR(squared_distance(x, Vec3(1, 1, 1)), 4.0 / 3, 1e-15);       // over the oblique face, 2/sqrt(3)
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(0.5, -3, -4)), 25);          // over an edge
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(-1, -2, -2)), 9);            // over a corner
  EXPECT_DOUBLE_EQ(squared_distance(x, Vec3(3, 0, 0)), 4);
}

TEST(TetTree, NearestAgreesWithASearchOfAllTets) {
  TetMesh mesh = test::kuhn_lattice({4, 3, 5}, 0.25);
  const TetTree tree(mesh);
  for (const Vec3& p : random_points(500, -0.5, 2)) {
    TetTree::Hit best{0, squared_distance(corners(mesh, 0), p)};
    for (int t = 1; t < mesh.tet_count(); ++t) {
      const double d = squared_distance(corners(mesh, t), p);
      if (d < best.squared_distance) best = {t, d};
    }
    const auto hit = tree.nearest(p);
    EXPECT_EQ(hit.tet, best.tet);
    EXPECT_EQ(hit.squared_distance, best.squared_distance);
  }
}

TEST(TetTree, OnASharedNodeTheLowestTetWins) {
  const TetMesh mesh = test::kuhn_lattice({2, 2, 2}, 1);
  const auto hit = TetTree(mesh).nearest(Vec3(1, 1, 1));
  EXPECT_EQ(hit.squared_distance, 0);
  for (int t = 0; t < hit.tet; ++t) EXPECT_GT(squared_distance(corners(mesh, t), Vec3(1, 1, 1)), 0);
}

TEST(Embedding, EnclosedVerticesHaveBarycentricWeights) {
  const TetMesh mesh = test::kuhn_lattice({4, 4, 4}, 0.25);
  const auto vertices = random_points(300, 0, 1);
  const Embedding embedding = embed(vertices, mesh);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    EXPECT_GE(embedding.weights[v].minCoeff(), -1e-12);  // rounding of a solve with condition about 10
    EXPECT_NEAR(embedding.weights[v].sum(), 1, 1e-15);
  }
}

TEST(Embedding, AnAffineMotionCarriesEveryVertexInsideOrOut) {
  const TetMesh mesh = test::kuhn_lattice({3, 3, 3}, 1.0 / 3);
  const auto vertices = random_points(300, -0.3, 1.3);
  const Embedding embedding = embed(vertices, mesh);
  Mat3 A;
  A << 1.1, 0.3, -0.2, 0.1, 0.8, 0.4, 0, -0.5, 1.3;
  const Vec3 shift(1, -2, 3);
  std::vector<Vec3> x;
  for (const Vec3& X : mesh.X) x.push_back(A * X + shift);
  std::vector<Vec3> out(vertices.size());
  embedded_positions(embedding, mesh.tets, x, out);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    EXPECT_LT((out[v] - (A * vertices[v] + shift)).norm(), 1e-12);
}

}  // namespace
}  // namespace crumple::sim
