#include "server/sim/contact/surface_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace crumple::sim::contact {
namespace {

constexpr std::uint8_t kOppositeLast = 8, kBesideFirst = 14;  // the face opposite node 3; the three that meet in node 0

// A wide tet below y = 0, and what has come through its upper face.
struct Meeting {
  OrientedTet below, above;
  TetOverlap common;
  double area;  // of the part of y = 0 in both [m^2]

  explicit Meeting(const Mat34& x) : above(orient(x)) {
    Mat34 wide;
    wide << Vec3(-10, 0, -10), Vec3(20, 0, -10), Vec3(-10, 0, 20), Vec3(-5, -10, -5);
    below = orient(wide);
    common = overlap(above, below);
    area = common.face_area[7].norm();
  }
  double depth(std::uint8_t of_above, std::uint8_t of_below, const Vec3& normal = Vec3::UnitY()) const {
    return surface_depth(common, area, normal, {above, of_above}, {below, of_below});
  }
};

Mat34 tip(double depth) {
  Mat34 x;
  x << Vec3(0, -depth, 0), Vec3(0.3, 1 - depth, 0), Vec3(-0.2, 1 - depth, 0.3), Vec3(-0.2, 1 - depth, -0.3);
  return x;
}

// deeper: of the corner at x = 18.
Mat34 slab(double depth, double deeper = 0) {
  Mat34 x;
  x << Vec3(-8, -depth, -8), Vec3(18, -depth - deeper, -8), Vec3(-8, -depth, 18), Vec3(-4, 9, -4);
  return x;
}

TEST(SurfaceDepth, OfASlabIsItsThickness) {
  const Meeting m(slab(0.01));
  ASSERT_GT(m.common.volume, 0);
  EXPECT_NEAR(m.depth(kOppositeLast, kOppositeLast), 0.01, 1e-12);
  EXPECT_NEAR(m.depth(0, kOppositeLast), 0.01, 1e-12);  // either surface is enough
  EXPECT_NEAR(m.depth(kOppositeLast, 0), 0.01, 1e-12);
}

TEST(SurfaceDepth, OfAWedgeIsItsDeepestCorner) {
  const Meeting m(slab(0.017, 0.010));
  EXPECT_LT(overlap_depth(m.common.volume, m.area), 0.0205);
  for (const auto [above, below] : {std::pair{kOppositeLast, kOppositeLast}, {std::uint8_t{0}, kOppositeLast}, {kOppositeLast, std::uint8_t{0}}})
    EXPECT_NEAR(m.depth(above, below), 0.027, 1e-4);
}

TEST(SurfaceDepth, IsMeasuredAlongTheNormal) {
  const Meeting m(slab(0.01));
  const double cosine = 0.9;
  const Vec3 tilted(std::sqrt(1 - cosine * cosine), cosine, 0);
  EXPECT_NEAR(m.depth(kOppositeLast, kOppositeLast, tilted), 0.01 / cosine, 1e-12);
}

TEST(SurfaceDepth, OfATipIsHalfOfItsDepthWhereVolumeOverAreaIsAThird) {
  const Meeting m(tip(0.02));
  ASSERT_GT(m.common.volume, 0);
  EXPECT_NEAR(overlap_depth(m.common.volume, m.area), 0.02 / 3, 1e-9);
  EXPECT_NEAR(m.depth(kBesideFirst, kOppositeLast), 0.01, 1e-9);
}

TEST(SurfaceDepth, WhereNoFaceLooksAlongTheNormalItIsVolumeOverArea) {
  const Meeting m(tip(0.02));
  EXPECT_DOUBLE_EQ(m.depth(0, 0), overlap_depth(m.common.volume, m.area));
  EXPECT_DOUBLE_EQ(m.depth(kBesideFirst, 0), overlap_depth(m.common.volume, m.area));  // a steep tip's sides
}

TEST(SurfaceDepth, DoesNotDependOnWhichTetIsFirst) {
  const Meeting m(tip(0.02));
  const TetOverlap swapped = overlap(m.below, m.above);
  EXPECT_NEAR(surface_depth(swapped, m.area, -Vec3::UnitY(), {m.below, kOppositeLast}, {m.above, kBesideFirst}),
              m.depth(kBesideFirst, kOppositeLast), 1e-12);
  const Meeting wedge(slab(0.017, 0.010));
  EXPECT_NEAR(surface_depth(overlap(wedge.below, wedge.above), wedge.area, -Vec3::UnitY(), {wedge.below, 0}, {wedge.above, kOppositeLast}),
              wedge.depth(kOppositeLast, 0), 1e-12);
}

}  // namespace
}  // namespace crumple::sim::contact
