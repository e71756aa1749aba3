#include "server/rig/rig_picture.h"

#include "server/authoring/barrel_asset.h"
#include "server/io/png_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

namespace crumple::rig {
namespace {

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
