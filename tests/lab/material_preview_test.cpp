// What `crumple-lab preview` shows of a material.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "server/io/scene_file.h"
#include "server/lab/material_preview.h"
#include "server/lab/scene_picture.h"
#include "tests/support/temporary_folder.h"

namespace crumple::lab {
namespace {

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

std::filesystem::path shipped(const std::string& material) {
  return std::filesystem::path(CRUMPLE_SOURCE_DIR) / "deploy/materials" / (material + ".json");
}

TEST(MaterialPreview, GlassBreaksRubberSpringsBackSteelKeepsItsDent) {
  const test::TemporaryFolder folder;
  const auto glass = preview_material({shipped("glass")}, folder.path() / "glass");
  ASSERT_TRUE(glass) << glass.error().text();
  EXPECT_GT((*glass)["struck"]["pieces"], 10);
  EXPECT_GT((*glass)["pushed"]["pieces"], 1);
  const auto rubber = preview_material({shipped("rubber")}, folder.path() / "rubber");
  ASSERT_TRUE(rubber) << rubber.error().text();
  const auto steel = preview_material({shipped("steel")}, folder.path() / "steel");
  ASSERT_TRUE(steel) << steel.error().text();
  for (const char* panel : {"pushed", "bent", "struck"}) {
    EXPECT_EQ((*rubber)[panel]["pieces"], 1) << panel;
    EXPECT_EQ((*rubber)[panel]["plastic_strain_largest"], 0) << panel;
    EXPECT_GT((*steel)[panel]["plastic_strain_largest"], 0.01) << panel;
  }
  EXPECT_TRUE(io::load_scene((*glass)["scene"].get<std::string>()));
  const std::string picture = content((*glass)["picture"].get<std::string>());
  EXPECT_TRUE(picture.starts_with("<svg") && picture.ends_with("</svg>\n"));
  EXPECT_GT(std::count(picture.begin(), picture.end(), '\n'), 2000);
}

TEST(MaterialPreview, EveryShippedMaterialIsOne) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shipped("glass").parent_path())) {
    EXPECT_TRUE(preview_scene({entry.path()})) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST(MaterialPreview, EveryShippedWayToComeApartIsOne) {
  const test::TemporaryFolder folder;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shipped("glass").parent_path().parent_path() / "splinters")) {
    const auto scene = preview_scene({shipped("glass"), entry.path()});
    ASSERT_TRUE(scene) << entry.path();
    const std::string name = entry.path().filename().string();
    folder.write(name, *scene);
    const auto loaded = io::load_scene(folder.path() / name);
    ASSERT_TRUE(loaded) << loaded.error().text();
    const auto& panel = std::get<sim::FemModel>(loaded->scene.bodies.at(1).model);
    ASSERT_TRUE(panel.splinters);
    EXPECT_GT(panel.splinters->count, 100) << name;
    EXPECT_LT(panel.splinters->count, 10 * panel.mesh->tet_count()) << name;
    ++count;
  }
  EXPECT_EQ(count, 4);
}

TEST(MaterialPreview, AWrongMaterialIsNamedWithItsLine) {
  const test::TemporaryFolder folder;
  folder.write("odd.json", "{\n  \"young\": 1e6,\n  \"stiffness\": 3\n}\n");
  const auto unknown = preview_scene({folder.path() / "odd.json"});
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().text().find("stiffness"), std::string::npos);
  EXPECT_NE(unknown.error().text().find("odd.json, line 3"), std::string::npos) << unknown.error().text();
  EXPECT_FALSE(preview_scene({folder.path() / "missing.json"}));
  folder.write("soft.json", "{\"poisson_ratio\": 0.7}");
  const auto refused = preview_material({folder.path() / "soft.json"}, folder.path() / "out");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("poisson_ratio is 0.7"), std::string::npos) << refused.error().text();
}

// Two squares, one behind the other: the nearer one is drawn later; what is behind the camera is not drawn.
TEST(ScenePicture, DrawsFromFarToNear) {
  Topology topology;
  Frame frame;
  for (int k = 0; k < 3; ++k) {
    BodyTopology square{.id = static_cast<BodyId>(k), .name = "square"};
    square.vertices = {Vec3f(-1, -1, 0), Vec3f(1, -1, 0), Vec3f(0, 1, 0)};
    square.triangles = {{0, 1, 2}};
    square.colour = {k == 0 ? 1.0f : 0.0f, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f};
    topology.bodies.push_back(square);
  }
  const double z[] = {1, -1, 9};  // red before green, blue behind the eye
  for (int k = 0; k < 3; ++k) frame.bodies.push_back({.id = static_cast<BodyId>(k), .pose = {Quat::Identity(), Vec3(0, 0, z[k])}});
  const std::string svg = svg_tile(topology, frame, {.eye = Vec3(0, 0, 6)}, 0, 0, 200, 200);
  const auto green = svg.find("fill=\"rgb(0,2"), red = svg.find(",0,0)\"");
  ASSERT_NE(green, std::string::npos) << svg;
  ASSERT_NE(red, std::string::npos);
  EXPECT_LT(green, red);
  EXPECT_EQ(std::count(svg.begin(), svg.end(), 'M'), 2);
}

}  // namespace
}  // namespace crumple::lab
