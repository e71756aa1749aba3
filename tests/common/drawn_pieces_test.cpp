#include "common/drawn_pieces.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple {
namespace {

Vec3 moved(const PieceMotion& motion, const Vec3f& X) { return motion.rotation() * X.cast<double>() + motion.t.cast<double>(); }

// A strip of triangles over each run of vertices.
BodyTopology strips(const std::vector<int>& lengths) {
  BodyTopology body;
  for (const int length : lengths) {
    const int first = static_cast<int>(body.vertices.size());
    for (int v = 0; v < length; ++v) body.vertices.emplace_back(static_cast<float>(first + v), static_cast<float>(v % 2), 0.0f);
    for (int v = 2; v < length; ++v) body.triangles.push_back({first + v, first + v - 1, first + v - 2});
  }
  return body;
}

TEST(DrawnPieces, AreWhatChainsOfTrianglesJoin) {
  const DrawnPieces pieces = drawn_pieces(strips({9, 12}));
  EXPECT_EQ(pieces.count, 2);
  for (int v = 0; v < 21; ++v) EXPECT_EQ(pieces.piece_of[v], v < 9 ? 0 : 1) << v;
}

TEST(DrawnPieces, WhatIsTooSmallMakesOneLastPiece) {
  const DrawnPieces pieces = drawn_pieces(strips({3, 9, 1, 1, 7, 8}));
  EXPECT_EQ(pieces.count, 3);
  EXPECT_EQ(pieces.piece_of[0], 2);
  EXPECT_EQ(pieces.piece_of[3], 0);
  EXPECT_EQ(pieces.piece_of[12], 2);  // in no triangle
  EXPECT_EQ(pieces.piece_of[14], 2);
  EXPECT_EQ(pieces.piece_of[21], 1);
  EXPECT_EQ(drawn_pieces({}).count, 0);
}

TEST(DrawnPieces, ARigidMotionIsFound) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1, 1);
  for (const float thickness : {1.0f, 0.0f}) {  // a flat piece, too
    BodyTopology body = strips({20, 30});
    for (Vec3f& X : body.vertices) X = Vec3f(any(random), any(random), thickness * any(random));
    const PieceMotion motions[2] = {{Eigen::Quaternionf(Eigen::AngleAxisf(2.5f, Vec3f(1, 2, 3).normalized())), Vec3f(5, -6, 7)}, {}};
    const DrawnPieces pieces = drawn_pieces(body);
    std::vector<Vec3f> x;
    for (std::size_t v = 0; v < body.vertices.size(); ++v) x.push_back(moved(motions[pieces.piece_of[v]], body.vertices[v]).cast<float>());
    const auto found = nearest_motions(pieces, body.vertices, x);
    for (int p = 0; p < 2; ++p) {
      EXPECT_LT(found[p].R.angularDistance(motions[p].R), 1e-3f);  // of floats, an angle's cosine: half the digits
      EXPECT_LT((found[p].t - motions[p].t).norm(), 1e-5f);
    }
    for (std::size_t v = 0; v < x.size(); ++v)
      EXPECT_LT((moved(found[pieces.piece_of[v]], body.vertices[v]) - x[v].cast<double>()).norm(), 1e-5);  // ten roundings at 10 m
  }
}

TEST(DrawnPieces, AMirroredPieceIsTurnedNotMirrored) {
  BodyTopology body = strips({12});
  for (int v = 0; v < 12; ++v) body.vertices[v].z() = static_cast<float>(v * v % 5);
  std::vector<Vec3f> x = body.vertices;
  for (Vec3f& p : x) p.x() = -p.x();
  const auto found = nearest_motions(drawn_pieces(body), body.vertices, x);
  EXPECT_NEAR(found[0].R.toRotationMatrix().determinant(), 1, 1e-5);
}

}  // namespace
}  // namespace crumple
