#include "server/io/asset_file.h"

#include "server/authoring/barrel_asset.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

namespace crumple::io {
namespace {

using sim::example_based::ExampleSet;
using test::TemporaryFolder;

sim::TetMesh one_tet() {
  return {{Vec3(0.1, 0, 0), Vec3(1, 1e-9, 0), Vec3(0, 1, 0), Vec3(0, 0, 1.0 / 3)}, {{0, 1, 2, 3}}, {0.7}};
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class AssetFile : public testing::TestWithParam<const char*> {};

TEST_P(AssetFile, ComesBackEqual) {
  const TemporaryFolder folder;
  authoring::BarrelAsset coarse;
  coarse.cell_size = 0.3;
  const auto barrel = authoring::make_barrel_asset(coarse);
  ASSERT_TRUE(barrel) << barrel.error().text();
  const std::filesystem::path file = folder.path() / GetParam();
  ASSERT_TRUE(write_asset({"barrel", *barrel}, file));
  const auto back = read_asset(file);
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->name, "barrel");
  const ExampleSet& set = std::get<ExampleSet>(back->content);
  EXPECT_EQ(set.mesh.X, barrel->mesh.X);
  EXPECT_EQ(set.mesh.tets, barrel->mesh.tets);
  EXPECT_EQ(set.mesh.fill, barrel->mesh.fill);
  EXPECT_EQ(set.W, barrel->W);
  EXPECT_EQ(set.convex_parts, barrel->convex_parts);
  EXPECT_EQ(set.render.triangles, barrel->render.triangles);
  ASSERT_EQ(set.example_count(), barrel->example_count());
  EXPECT_EQ(set.examples.back().bones.back().t, barrel->examples.back().bones.back().t);
  EXPECT_EQ(set.examples.back().bones.back().q.coeffs(), barrel->examples.back().bones.back().q.coeffs());

  ASSERT_TRUE(write_asset({"tet", one_tet()}, file));
  const auto tet = read_asset(file);
  ASSERT_TRUE(tet) << tet.error().text();
  EXPECT_EQ(std::get<sim::TetMesh>(tet->content).X, one_tet().X);

  const sim::SurfaceMesh surface{one_tet().X, {{0, 2, 1}}};
  ASSERT_TRUE(write_asset({"", surface}, file));
  const auto triangle = read_asset(file);
  ASSERT_TRUE(triangle) << triangle.error().text();
  EXPECT_EQ(std::get<sim::SurfaceMesh>(triangle->content).vertices, surface.vertices);
}

INSTANTIATE_TEST_SUITE_P(Forms, AssetFile, testing::Values("a.crumple-asset", "a.json"), [](const auto& info) {
  return info.index == 0 ? std::string("Binary") : std::string("Json");
});

// Cut anywhere, changed anywhere: an error, never another asset.
TEST(AssetFile, DamageIsAnError) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "a.crumple-asset";
  ASSERT_TRUE(write_asset({"tet", one_tet()}, file));
  const std::string good = bytes_of(file);
  ASSERT_GT(good.size(), 24u);
  for (std::size_t i = 0; i < good.size(); ++i) {
    EXPECT_FALSE(read_asset(folder.write("cut.crumple-asset", good.substr(0, i)))) << "cut at " << i;
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 1);
    EXPECT_FALSE(read_asset(folder.write("bad.crumple-asset", bad))) << "changed at " << i;
  }
  EXPECT_FALSE(read_asset(folder.write("long.crumple-asset", good + "x")));
}

TEST(AssetFile, AnotherVersionIsAnError) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "a.crumple-asset";
  ASSERT_TRUE(write_asset({"tet", one_tet()}, file));
  std::string bytes = bytes_of(file);
  bytes[8] = 2;
  const auto asset = read_asset(folder.write("b.crumple-asset", bytes));
  ASSERT_FALSE(asset);
  EXPECT_NE(asset.error().message.find("has format version 2, must have 1"), std::string::npos) << asset.error().text();
}

TEST(AssetFile, ErrorsNameFileFieldAndLine) {
  const TemporaryFolder folder;
  const auto asset = read_asset(folder.write("t.json",
                                             "{\"tet_mesh\": {\"positions\": [0,0,0, 1,0,0, 0,1,0, 0,0,1],\n"
                                             "\"tets\": [0,1,2,7]}}"));
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().field, "tet_mesh.tets[0]");
  EXPECT_NE(asset.error().message.find("(t.json, line 2)"), std::string::npos) << asset.error().text();
  const auto none = read_asset(folder.write("none.json", "{}"));
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("must hold one of"), std::string::npos);
}

}  // namespace
}  // namespace crumple::io
