// crumple-rig as a program.
#include "common/text.h"
#include "server/io/asset_file.h"
#include "server/io/rig_import.h"
#include "server/io/scene_file.h"
#include "server/rig/rig_files.h"
#include "server/sim/world.h"
#include "tests/rig/rig_program.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple::rig {
namespace {

using ::testing::HasSubstr;

TEST(RigProgram, MakesAnAssetAPictureASceneAndAGltf) {
  const test::TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder.path() / name).string(); };
  const auto [code, result] =
      run({folder.write("block.obj", kBlock).string(), "--out", at("block.crumple-asset"), "--tets", "400", "--auto",
           "8", "--picture", at("block.svg"), "--scene", at("block.json"), "--gltf", at("block.glb")});
  ASSERT_EQ(code, 0);
  EXPECT_EQ(result["vertices_enclosed_percent"], 100);
  EXPECT_EQ(result["handles"]["automatic"], 8);
  EXPECT_LE(result["tets"], 400);
  EXPECT_EQ(result["examples"].size(), 6u);
  EXPECT_THAT(content_of(at("block.svg")), HasSubstr(">crushed_max_z</text>"));
  ASSERT_EQ(run({"pose", at("block.crumple-asset"), "--name", "a", "--handle", "auto 1", "0", "0", "0", "--picture",
                 at("block.png")})
                .first,
            0);
  EXPECT_THAT(content_of(at("block.png")), testing::StartsWith("\x89PNG"));
  const auto back = io::import_artist_mesh(at("block.glb"));
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->handles.size(), 8u);

  // The scene is ready: the body falls, and dents.
  const auto loaded = io::load_scene(at("block.json"));
  ASSERT_TRUE(loaded) << loaded.error().text();
  const auto world = sim::World::create(loaded->scene);
  ASSERT_TRUE(world) << world.error().text();
  for (int k = 0; k < 600; ++k) (*world)->step();
  const BodyId body = (*world)->find("dropped");
  const Eigen::MatrixXd& E = (*world)->example_weights(body);
  EXPECT_GT((1 - E.col(0).array()).maxCoeff(), 0.05);
  EXPECT_LT((*world)->pose(body).p_WB.norm(), 6);
}

TEST(RigProgram, TakesHandlesAndPosesFromFiles) {
  const test::TemporaryFolder folder;
  const auto asset = (folder.path() / "block.json").string();
  const auto handles = folder.write(
      "handles.json",
      R"({"handles": [{"name": "left", "position": {"x": -1, "y": 0.5}}, {"name": "right", "position": {"x": 1, "y": 0.5}}]})");
  const auto poses = folder.write(
      "poses.json",
      R"({"poses": [{"name": "stretched", "moves": [{"handle": "left", "position": {"x": -2, "y": 0.5}}, {"handle": "right"}]}]})");
  const auto mesh = folder.write("block.obj", kBlock).string();
  ASSERT_EQ(run({mesh, "--out", asset, "--tets", "400", "--handles", handles.string(), "--poses", poses.string(),
                 "--auto", "4"})
                .first,
            0);

  const auto [code, shown] = run({"pose", asset, "--name", "lifted", "--handle", "right", "1", "1.5", "0", "--turn",
                                  "left", "0", "0", "90", "--hold"});
  ASSERT_EQ(code, 0);
  EXPECT_EQ(shown["examples"], json({"rest", "stretched", "lifted"}));
  EXPECT_GT(shown["posed"]["strain"], 0);
  ASSERT_EQ(run({"pose", asset, "--name", "free", "--handle", "right", "1", "1.5", "0"}).first, 0);
  const auto read = io::read_asset(asset);
  ASSERT_TRUE(read) << read.error().text();
  const auto& set = std::get<sim::example_based::ExampleSet>(read->content);
  ASSERT_EQ(set.handles.size(), 6u);
  const auto& stretched = set.examples[1].bones;
  const Vec3 left(-1, 0.5, 0), right(1, 0.5, 0);
  EXPECT_LT((stretched[0].q * left + stretched[0].t - Vec3(-2, 0.5, 0)).norm(), 1e-12);
  EXPECT_LT((stretched[1].q * right + stretched[1].t - right).norm(), 1e-12);
  const auto& lifted = set.examples[2].bones;
  EXPECT_LT((lifted[1].q * right + lifted[1].t - Vec3(1, 1.5, 0)).norm(), 1e-12);
  EXPECT_LT((lifted[0].q * left + lifted[0].t - left).norm(), 1e-12) << "turned about its own place";
  EXPECT_NEAR(lifted[0].q.angularDistance(Quat::Identity()), M_PI / 2, 1e-12);
  for (int b = 2; b < 6; ++b) EXPECT_LT(lifted[b].t.norm(), 1e-12) << "only moved handles move";
  for (const auto& bone : set.examples[3].bones)
    EXPECT_LT((bone.t - Vec3(0, 1, 0)).norm(), 1e-6) << "what is not named goes along";
  EXPECT_EQ(run({"show", asset}).second["handles"][1]["name"], "right");
}

TEST(RigProgram, PressesSidesInOneCommand) {
  const test::TemporaryFolder folder;
  const auto asset = (folder.path() / "block.crumple-asset").string();
  const auto [code, result] = run({"crush", folder.write("block.obj", kBlock).string(), "--side", "+x,-y", "--out",
                                   asset, "--tets", "300", "--depth", "0.2"});
  ASSERT_EQ(code, 0);
  ASSERT_EQ(result["crushed"].size(), 2u);
  EXPECT_LT(result["crushed"][0]["thickness"], 0.9);
  EXPECT_EQ(run({"crush", asset, "--side", "+z", "--name", "flat"}).first, 0);
  EXPECT_EQ(run({"show", asset}).second["examples"], json({"rest", "pressed +x", "pressed -y", "flat"}));
}

TEST(RigProgram, ExitsWithTwoOnBadInputAndWritesNothing) {
  const test::TemporaryFolder folder;
  const std::string mesh = folder.write("block.obj", kBlock).string(),
                    out = (folder.path() / "out.crumple-asset").string();
  const std::string bad = folder.write("bad.json", R"({"handles": [{"name": "a", "positon": {}}]})").string();
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {mesh},
                                             {"nowhere.obj", "--out", out},
                                             {mesh, "--out", out, "--cell-size", "-1"},
                                             {mesh, "--out", out, "--handles", bad},
                                             {mesh, "--out", out, "--regions"},
                                             {mesh, "--out", out, "--weights", "painted"},
                                             {mesh, "--out", out, "--weights", "heat"},
                                             {mesh, "--out", out, "--tolerance", "0.1"},
                                             {mesh, "--out", out, "--crushed", "sometimes"},
                                             {mesh, "--out", out, "--picture", "a.bmp"},
                                             {mesh, "--out", out, "--auto", "0"},
                                             {mesh, "--out", out, "--gltf", "a.gltf"},
                                             {"pose", mesh, "--name", "a", "--handle", "b", "0", "0", "0"},
                                             {"crush", mesh, "--out", out, "--depth", "2"},
                                             {"crush", mesh, "--out", out, "--side", "up"},
                                             {"show", "nowhere.crumple-asset"}})
    EXPECT_EQ(run(words).first, 2) << testing::PrintToString(words);
  EXPECT_FALSE(std::filesystem::exists(out));
}

// A slip of the keyboard must not cost the artist the mesh, nor one result another one.
TEST(RigProgram, WritesOverNoFileThatItReadsOrWrites) {
  const test::TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder.path() / name).string(); };
  const std::string mesh = folder.write("block.obj", kBlock).string();
  const std::string poses = folder.write("poses.json", R"({"poses": []})").string();
  std::filesystem::create_directory(folder.path() / "sub");
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {mesh, "--out", mesh},
           {mesh, "--out", at("asset")},
           {mesh, "--out", poses, "--poses", poses},
           {mesh, "--out", at("a.json"), "--scene", at("sub/../a.json")},
           {mesh, "--out", at("a.json"), "--scene", at("a.crumple-asset")},
           {mesh, "--out", at("a.json"), "--scene", at("sub/scene.json")},  // a scene's files lie below it
           {"crush", mesh, "--out", mesh}})
    EXPECT_EQ(run(words).first, 2) << testing::PrintToString(words);
  EXPECT_EQ(content_of(mesh), kBlock);
  EXPECT_FALSE(std::filesystem::exists(at("a.json")));
  ASSERT_EQ(run({mesh, "--out", at("a.json"), "--tets", "300"}).first, 0);
  EXPECT_EQ(run({"pose", at("a.json"), "--name", "a", "--handle", "auto 1", "0", "0", "0", "--gltf", mesh}).first, 2);
  EXPECT_EQ(run({"pose", at("a.json"), "--name", "a", "--handle", "auto 1", "0", "0", "0"}).first, 0) << "in place";
}

// Painted red where x > 0 in a PLY or an OBJ: impulses deform that end 16 times as much.
class RigPainted : public testing::TestWithParam<const char*> {};

TEST_P(RigPainted, VertexColoursMakeRegions) {
  const test::TemporaryFolder folder;
  const std::string name = GetParam();
  std::string content = name == "a.ply"
                            ? "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
                              "property float z\nproperty uchar red\nproperty uchar green\n"
                              "property uchar blue\nelement face 6\n"
                              "property list uchar int vertex_indices\nend_header\n"
                            : "";
  for (int k = 0; k < 8; ++k) {
    const bool right = (k & 1) != 0;
    const std::string place = text(right ? 1 : -1, " ", k & 2 ? 1 : 0, " ", k & 4 ? 0.5 : -0.5);
    content += name == "a.ply" ? text(place, right ? " 255 0 0\n" : " 0 0 255\n")
                               : text("v ", place, right ? " 1 0 0\n" : " 0 0 1\n");
  }
  for (const auto& [a, b, c, d] :
       {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {1, 3, 7, 5}, {0, 4, 6, 2}})
    content += name == "a.ply" ? text("4 ", a, " ", b, " ", c, " ", d, "\n")
                               : text("f ", a + 1, " ", b + 1, " ", c + 1, " ", d + 1, "\n");
  const auto asset = (folder.path() / "a.crumple-asset").string();
  ASSERT_EQ(run({folder.write(name, content).string(), "--out", asset, "--tets", "300", "--regions"}).first, 0);
  const auto read = io::read_asset(asset);
  ASSERT_TRUE(read) << read.error().text();
  const auto& set = std::get<sim::example_based::ExampleSet>(read->content);
  ASSERT_EQ(static_cast<int>(set.alpha_scale.size()), set.vertex_count());
  ASSERT_EQ(static_cast<int>(set.beta_scale.size()), set.vertex_count());
  int ends = 0;
  for (int i = 0; i < set.vertex_count(); ++i) {
    const double x = set.mesh.X[i].x();
    if (std::abs(x) < 0.999) continue;
    ++ends;
    EXPECT_NEAR(set.alpha_scale[i], x > 0 ? 16 : 1.0 / 16, x > 0 ? 0.2 : 0.002);
    EXPECT_NEAR(set.beta_scale[i], x < 0 ? 16 : 1.0 / 16, x < 0 ? 0.2 : 0.002);
  }
  EXPECT_GT(ends, 8);
}

INSTANTIATE_TEST_SUITE_P(Formats, RigPainted, testing::Values("a.ply", "a.obj"),
                         [](const auto& info) { return std::string(info.param).substr(2); });

TEST(RigFiles, ErrorsNameFileLineAndRule) {
  const test::TemporaryFolder folder;
  const auto handles = [&](const std::string& content) {
    return read_handles(folder.write("h.json", content)).error().text();
  };
  EXPECT_THAT(handles("{\"handles\": [\n{\"name\": \"a\"},\n{\"name\": \"a\"}]}"),
              HasSubstr("handles[1].name is \"a\", which another handle has (h.json, line 3)"));
  EXPECT_THAT(handles("{\"handles\": [{\"name\": \"\"}]}"),
              HasSubstr("handles[0].name has 0 bytes, must have 1 to 256 (h.json, line 1)"));
  EXPECT_THAT(handles("{\"handles\": [{\"name\": \"a\", \"position\": {\"x\": 1e9}}]}"),
              HasSubstr("handles[0].position must be finite and within 1e6 m"));
  EXPECT_THAT(handles("{}"), HasSubstr("handles is empty"));
  EXPECT_THAT(handles("{\"handles\": ["), HasSubstr("is not JSON"));
  const auto poses = read_poses(
      folder.write("p.json", "{\"poses\": [{\"moves\": [\n{\"handle\": \"a\", \"rotation\": {\"w\": 0}}]}]}"));
  ASSERT_FALSE(poses);
  EXPECT_THAT(poses.error().text(), HasSubstr("poses[0].moves[0].rotation"));
  EXPECT_THAT(poses.error().text(), HasSubstr("(p.json, line 2)"));
  EXPECT_THAT(read_poses(folder.write("p.json", "{\"poses\": []}")).error().text(), HasSubstr("poses is empty"));
}

// ---- real meshes: open, self-intersecting, of many parts -----------------------------------------------------------
class RigOfShared : public testing::TestWithParam<const char*> {};

TEST_P(RigOfShared, EnclosesAllVerticesAndLoadsAsAScene) {
  CRUMPLE_NEED_SHARED("meshes");
  const test::TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder.path() / name).string(); };
  const auto [code, result] = run({(test::shared_data("meshes") / GetParam()).string(), "--out", at("a.crumple-asset"),
                                   "--tets", "2000", "--scene", at("a.json"), "--gltf", at("a.glb")});
  ASSERT_EQ(code, 0);
  EXPECT_EQ(result["vertices_enclosed_percent"], 100);
  EXPECT_LE(result["tets"], 2000);
  EXPECT_TRUE(io::import_artist_mesh(at("a.glb")));
  const auto loaded = io::load_scene(at("a.json"));
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_TRUE(sim::World::create(loaded->scene));
}

INSTANTIATE_TEST_SUITE_P(Meshes, RigOfShared,
                         testing::Values("kaykit_car_sedan.obj", "kaykit_barrel_large.glb", "kaykit_barrel_small.glb",
                                         "kaykit_wall_cracked.glb", "kaykit_wall_gated.glb", "kaykit_pillar.glb",
                                         "kaykit_table_long.glb", "kaykit_lander_A.obj",
                                         "kenneykit_vehicle-truck-red.glb", "vega_beam3_tet.obj",
                                         "vega_simpleBridge.obj", "vega_towerCrane_resol166.obj", "od_spot_low.obj",
                                         "blender_rig_sample.glb"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase_if(name, [](unsigned char c) { return !std::isalnum(c); });
                           return name;
                         });

}  // namespace
}  // namespace crumple::rig
