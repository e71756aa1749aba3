#include "common/vertex_normals.h"

#include <gtest/gtest.h>

#include <cmath>

namespace crumple {
namespace {

// A tube of unit radius: the normal of a vertex is its radius, whatever the triangles' diagonals do.
TEST(VertexNormals, OfATubeAreItsRadii) {
  constexpr int kRound = 24, kAlong = 8;
  std::vector<Vec3f> positions;
  std::vector<Triangle> triangles;
  for (int j = 0; j <= kAlong; ++j)
    for (int i = 0; i < kRound; ++i) {
      const double turn = 2 * M_PI * i / kRound;
      positions.push_back(Vec3f(std::cos(turn), 0.1 * j, -std::sin(turn)));
    }
  for (int j = 0; j < kAlong; ++j)
    for (int i = 0; i < kRound; ++i) {
      const int a = j * kRound + i, b = j * kRound + (i + 1) % kRound;
      triangles.push_back({a, b, b + kRound});
      triangles.push_back({a, b + kRound, a + kRound});
    }
  std::vector<Vec3f> normals;
  vertex_normals(positions, triangles, normals);
  ASSERT_EQ(normals.size(), positions.size());
  for (int v = kRound; v < kAlong * kRound; ++v) {  // rims have one diagonal too many
    EXPECT_NEAR(normals[v].norm(), 1, 1e-6);
    EXPECT_GT(normals[v].dot(Vec3f(positions[v].x(), 0, positions[v].z())), 0.999f);
  }
}

TEST(VertexNormals, LargerTrianglesWeighMoreAndVerticesOfNoAreaGetNone) {
  const std::vector<Vec3f> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 3}, {5, 5, 5}, {1e-25f, 0, 0}, {0, 1e-25f, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {4, 4, 4}};
  std::vector<Vec3f> normals;
  vertex_normals(positions, triangles, normals);
  EXPECT_LT((normals[1] - Vec3f(0, 0, 1)).norm(), 1e-6f);
  EXPECT_LT((normals[3] - Vec3f(1, 0, 0)).norm(), 1e-6f);
  EXPECT_LT((normals[0] - Vec3f(3, 0, 1).normalized()).norm(), 1e-6f);
  EXPECT_EQ(normals[4], Vec3f::Zero());
  EXPECT_EQ(normals[6], Vec3f::Zero());
}

}  // namespace
}  // namespace crumple
