#include "server/rig/rig_picture.h"

#include "server/authoring/barrel_asset.h"
#include "server/io/png_writer.h"
#include "server/rig/raster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

namespace crumple::rig {
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
TEST(PngWriter, UnpacksToItsPixels) {
  const std::vector<std::uint8_t> rgb{1, 2, 3, 250, 5, 6, 7, 8, 9, 4, 11, 255};
  const std::string png = io::png_of(rgb, 2, 2);
  ASSERT_TRUE(png.starts_with(std::string("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x02\0\0\0\x02\x08\x02\0\0\0", 29)));
  EXPECT_TRUE(png.ends_with(std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12)))
      << "the CRC that the standard gives for it";
  const std::size_t at = png.find("IDAT");
  ASSERT_NE(at, std::string::npos);
  std::string lines(14, 0);
  uLongf size = 14;
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(lines.data()), &size,
                       reinterpret_cast<const Bytef*>(png.data() + at + 4), png.size() - at - 4),
            Z_OK);
  EXPECT_EQ(lines, std::string("\2\1\2\3\xfa\5\6\2\6\6\6\x0a\6\xf9", 14));
}

TEST(RigPicture, NamesEachExample) {
  authoring::BarrelAsset coarse;
  coarse.cell_size = 0.3;
  auto set = authoring::make_barrel_asset(coarse);
  ASSERT_TRUE(set) << set.error().text();
  set->examples[1].name = "a < b & c";
  const std::string svg = rig_svg(*set);
  for (const char* name : {">18 handles<", ">rest<", ">a &lt; b &amp; c<", ">crumpled<"})
    EXPECT_THAT(svg, testing::HasSubstr(name));
  EXPECT_THAT(svg, testing::HasSubstr("width=\"1200\" height=\"652\""));
  EXPECT_TRUE(rig_png(*set).substr(16, 8) == std::string("\0\0\x04\xb0\0\0\x02\x58", 8)) << "1200 x 600";
}

}  // namespace
}  // namespace crumple::rig
