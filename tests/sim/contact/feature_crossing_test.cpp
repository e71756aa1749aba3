#include "server/sim/contact/feature_crossing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace crumple::sim::contact {
namespace {

Mat34 points(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  Mat34 x;
  x << a, b, c, d;
  return x;
}

const Vec3 kStill = Vec3::Zero();

TEST(FeatureCrossing, ANodeThatFallsStraightMeetsTheTriangleWhereAndWhenItMust) {
  const Mat34 p = points({0.2, 3, 0.3}, {0, 0, 0}, {0, 0, 1}, {1, 0, 0}), d = points({0, -4, 0}, kStill, kStill, kStill);
  const FeatureCrossings found = node_through_triangle(p, d, 0);
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.at[0].t, 0.75, 1e-14);
  EXPECT_TRUE(found.at[0].weights.isApprox(Eigen::Vector4d(1, 0.5, 0.3, 0.2), 1e-13)) << found.at[0].weights.transpose();
  EXPECT_TRUE(found.at[0].normal.isApprox(Vec3::UnitY(), 1e-13));
  EXPECT_TRUE(found.at[0].relative.isApprox(Vec3(0, -4, 0), 1e-13));
}

TEST(FeatureCrossing, ANodeMeetsNoTriangleBesideItsWayNorOneThatFliesAlong) {
  const Mat34 p = points({0.7, 1, 0.7}, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});
  const Vec3 down(0, -2, 0);
  EXPECT_EQ(node_through_triangle(p, points(down, kStill, kStill, kStill), 0).count, 0);  // x + z = 1.4 > 1
  EXPECT_EQ(node_through_triangle(p, points(down, down, down, down), 0).count, 0);
}

// A node at height h over a triangle's plane that turns into a quadratic: the corner at x = 1 rises by 4 h as the node falls.
// With the node over (1/2, 0) the plane is at 2 h t there and the node at h (1 - 2 t), so they meet at t = 1/4.
TEST(FeatureCrossing, BothMayMove) {
  const double h = 0.3;
  const Mat34 p = points({0.5, h, 0.0}, {0, 0, -1}, {0, 0, 1}, {1, 0, 0});
  const Mat34 d = points({0, -2 * h, 0}, kStill, kStill, {0, 4 * h, 0});
  const FeatureCrossings found = node_through_triangle(p, d, 0);
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.at[0].t, 0.25, 1e-13);
}

// (t - 0.2)(t - 0.5)(t - 0.9) as the volume of four points: the cubic has all of its three roots.
TEST(FeatureCrossing, TheCubicsThreeRootsAreFound) {
  // e_k + t g_k along the axes: the product of (e_k + t g_k).
  const Mat34 p = points({0, 0, 0}, {-0.2, 0, 0}, {0, -0.5, 0}, {0, 0, -0.9});
  const Mat34 d = points({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const CoplanarTimes times = coplanar_times(p, d, 0);
  ASSERT_EQ(times.count, 3);
  EXPECT_NEAR(times.t[0], 0.2, 1e-13);
  EXPECT_NEAR(times.t[1], 0.5, 1e-13);
  EXPECT_NEAR(times.t[2], 0.9, 1e-13);
  EXPECT_EQ(coplanar_times(p, d, 0.4).count, 2);
}

TEST(FeatureCrossing, CrossedEdgesMeetInTheirMiddles) {
  const Mat34 p = points({-1, 1, 0}, {1, 1, 0}, {0, 0, -1}, {0, 0, 1}), d = points({0, -3, 0}, {0, -3, 0}, kStill, kStill);
  const FeatureCrossings found = edge_through_edge(p, d, 0);
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.at[0].t, 1.0 / 3, 1e-14);
  EXPECT_TRUE(found.at[0].weights.isApprox(Eigen::Vector4d::Constant(0.5), 1e-13));
  EXPECT_NEAR(std::abs(found.at[0].normal.y()), 1, 1e-13);
}

}  // namespace
}  // namespace crumple::sim::contact
