#include "server/lab/raster.h"

#include <gtest/gtest.h>

namespace crumple::lab {
namespace {

TEST(Raster, APatchCoversItsAreaOfTheTileAndNoMore) {
  Raster raster(20, 10, {0, 0, 0});
  // A triangle of 32 square pixels, half as strong, then one that leaves its tile to the left.
  raster.draw({{0, {Eigen::Vector2d(1, 1), {9, 1}, {1, 9}}, {200, 100, 0}, 0.5}}, 10, 0, 10, 10);
  raster.draw({{0, {Eigen::Vector2d(-100, -100), {-100, 100}, {-1, 0}}, {255, 255, 255}, 1}}, 10, 0, 10, 10);
  const auto rgb = raster.rgb();
  ASSERT_EQ(rgb.size(), 600u);
  double covered = 0;
  for (std::size_t k = 0; k < rgb.size(); k += 3) covered += rgb[k] / 100.0;
  EXPECT_NEAR(covered, 32, 1.5);  // nine samples a pixel along an edge of 11 pixels
  const auto at = [&](int x, int y) { return &rgb[static_cast<std::size_t>(3 * (20 * y + x))]; };
  EXPECT_EQ(at(12, 3)[0], 100);
  EXPECT_EQ(at(12, 3)[1], 50);
  EXPECT_EQ(at(5, 5)[0], 0);
  EXPECT_EQ(at(19, 9)[0], 0);
}

// What zlib and the format say, read by hand.

}  // namespace
}  // namespace crumple::lab
