#include "server/io/scene_file.h"

#include "server/io/asset_file.h"
#include "server/io/scene_folder.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

namespace crumple::io {
namespace {

using test::TemporaryFolder;

const std::string kTets = R"({"tet_mesh": {"positions": [0,0,0, 1,0,0, 0,1,0, 0,0,1], "tets": [0,1,2,3]}})";
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string fem_of(const std::string& file) {
  return R"({"bodies": [{"name": "b", "fem": {"mesh": {"file": ")" + file + R"("}}}]})";
}

TEST(SceneFile, ReadsAScene) {
  const TemporaryFolder folder;
  folder.write("meshes/one.json", kTets);
  const auto loaded = load_scene(folder.write("wall.json", R"({
    "gravity": {"y": -1.62}, "dt": 0.01,
    "bodies": [
      {"name": "jelly", "fem": {"mesh": {"file": "meshes/one.json", "scale": 2}, "material": {"young": 2e6}}},
      {"name": "floor", "rigid": {"kind": "FIXED", "shapes": [{"plane": {}}]}}
    ],
    "script": [{"time": 1, "command": {"apply_impulse": {"body": "jelly", "impulse": {"y": 3}}}}],
    "recording": {"every": 4, "formats": ["VTU"]}
  })"));
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(loaded->scene.name, "wall");
  EXPECT_EQ(loaded->scene.gravity, Vec3(0, -1.62, 0));
  ASSERT_EQ(loaded->scene.bodies.size(), 2u);
  EXPECT_EQ(std::get<sim::FemModel>(loaded->scene.bodies[0].model).mesh->X[1], Vec3(2, 0, 0));
  EXPECT_EQ(loaded->scene.script.size(), 1u);
  EXPECT_EQ(loaded->recording.every, 4);
  EXPECT_TRUE(loaded->recording.vtu && !loaded->recording.frames);
}

struct BadFile {
  const char* what;
  const char* json;
  const char* field;
  const char* message;
};
void PrintTo(const BadFile& b, std::ostream* out) { *out << b.what; }

class BadSceneFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadSceneFile, NamesFileLineFieldValueAndRule) {
  const TemporaryFolder folder;
  const auto loaded = load_scene(folder.write("s.json", GetParam().json));
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(loaded.error().field, GetParam().field) << loaded.error().text();
  EXPECT_NE(loaded.error().message.find(GetParam().message), std::string::npos) << loaded.error().text();
  EXPECT_NE(loaded.error().message.find("(s.json"), std::string::npos) << loaded.error().text();
}

const BadFile kBad[] = {
    {"unknown_field", "{\n\"bodies\": [\n{\"name\": \"a\",\n\"rigid\": {\"densty\": 3}}]}", "bodies[0].rigid.densty",
     "is not a field of the format (s.json, line 4)"},
    {"unknown_field_at_top", "{\"body\": []}", "body", "is not a field"},
    {"string_for_number", "{\"bodies\": [{\"rigid\": {\n\"density\": \"abc\"}}]}", "bodies[0].rigid.density",
     "is \"abc\", must be a number (s.json, line 2)"},
    {"fraction_for_integer", "{\"rigid_substeps\": 1.5}", "rigid_substeps", "is 1.5, must be an integer"},
    {"negative_seed", "{\"seed\": -1}", "seed", "is -1, must be an integer that is not negative"},
    {"number_for_bool", "{\"float_solver\": 3}", "float_solver", "is 3, must be true or false"},
    {"number_for_object", "{\"bodies\": [3]}", "bodies[0]", "is 3, must be "},
    {"enum_name", "{\"bodies\": [{\"rigid\": {\"kind\": \"FIXD\"}}]}", "bodies[0].rigid.kind",
     "is \"FIXD\", must be one of DYNAMIC, FIXED, KINEMATIC"},
    {"two_models", "{\"bodies\": [{\"rigid\": {}, \"fem\": {}}]}", "bodies[0].fem", "beside another model"},
    {"field_twice", "{\"dt\": 0.01, \"dt\": 0.02}", "", "gives the field \"dt\" twice"},
    {"both_spellings", "{\"rigid_substeps\": 1, \"rigidSubsteps\": 2}", "rigid_substeps", "is given twice"},
    {"syntax", "{\n\"dt\": 0.01,\n}", "", "line 3"},
    {"cut_off", "{\"bodies\": [", "", "is not JSON"},
    {"no_json", "solid cube", "", "is not JSON"},
    {"list_at_top", "[]", "", "must be a message"},
    {"nan", "{\"dt\": \"NaN\"}", "dt", "is nan, must be a number"},
    {"bare_nan", "{\"dt\": NaN}", "", "is not JSON"},
    {"overflow", "{\"dt\": 1e999}", "", "1e999"},
    {"poisson",
     "{\"bodies\": [{\"name\": \"a\",\n\"fem\": {\"mesh\": {\"box\": {}},\n\"material\": {\n"
     "\"poisson_ratio\": 0.5}}}]}",
     "bodies[0].fem.material.poisson_ratio", "is 0.5, must be below 0.5 (s.json, line 4)"},
    {"camel_case", "{\"bodies\": [{\"fem\": {\"material\": {\n\"poissonRatio\": true}}}]}",
     "bodies[0].fem.material.poisson_ratio", "is true, must be a number (s.json, line 2)"},
    {"missing_file", "{\"bodies\": [{\"name\": \"a\", \"fem\": {\"mesh\": {\"file\": \"no.msh\"}}}]}",
     "bodies[0].fem.mesh.file", "is \"no.msh\", which does not do: no.msh does not exist"},
    {"wrong_ending", "{\"bodies\": [{\"name\": \"a\", \"example\": {\"asset\": {\"file\": \"a.obj\"}}}]}",
     "bodies[0].example.asset.file", "must be an asset file"},
    {"script", "{\"script\": [\n{\"command\": {\"apply_force\": {\n\"body\": \"a\"}}}]}",
     "script[0].command.apply_force.body", "is \"a\", must name a body of the scene (s.json, line 3)"},
};

INSTANTIATE_TEST_SUITE_P(SceneFile, BadSceneFile, testing::ValuesIn(kBad),
                         [](const auto& info) { return std::string(info.param.what); });

TEST(SceneFile, DeepNestingIsAnErrorAndNoCrash) {
  const TemporaryFolder folder;
  std::string deep = "{\"bodies\":";
  deep.append(200'000, '[');
  const auto open = load_scene(folder.write("open.json", deep));
  ASSERT_FALSE(open);
  EXPECT_NE(open.error().message.find("deeper than 100"), std::string::npos) << open.error().text();
  deep.append(200'000, ']');
  EXPECT_FALSE(load_scene(folder.write("closed.json", deep + "}")));
}

TEST(SceneFile, AMissingFileIsNotFound) {
  const auto loaded = load_scene("/nowhere/at/all.json");
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::not_found);
}

TEST(SceneFile, FilesOutsideItsFolderAreErrors) {
  const TemporaryFolder folder;
  folder.write("outside.json", kTets);
  std::filesystem::create_directories(folder.path() / "scenes");
  std::filesystem::create_symlink(folder.path() / "outside.json", folder.path() / "scenes/link.json");
  std::filesystem::create_symlink(folder.path(), folder.path() / "scenes/up");
  for (const std::string& name :
       {(folder.path() / "outside.json").string(), std::string("../outside.json"), std::string("a/../../outside.json"),
        std::string("link.json"), std::string("up/outside.json"), std::string("../nowhere.json"), std::string()}) {
    const auto loaded = load_scene(folder.write("scenes/s.json", fem_of(name)));
    ASSERT_FALSE(loaded) << name;
    EXPECT_EQ(loaded.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(loaded.error().field, "bodies[0].fem.mesh.file");
    EXPECT_NE(loaded.error().message.find("inside the scene's folder"), std::string::npos) << loaded.error().text();
  }
}

TEST(SceneFile, LinksWithinItsFolderAreFollowed) {
  const TemporaryFolder folder;
  folder.write("meshes/one.json", kTets);
  std::filesystem::create_symlink(folder.path() / "meshes/one.json", folder.path() / "link.json");
  const auto loaded = load_scene(folder.write("s.json", fem_of("link.json")));
  EXPECT_TRUE(loaded) << loaded.error().text();
}

TEST(SceneFile, SurfacesBecomeHullsTrianglesAndTets) {
  const TemporaryFolder folder;
  folder.write("tet.obj", kObj);
  const auto loaded = load_scene(folder.write("s.json", R"({"bodies": [
    {"name": "hull", "rigid": {"shapes": [{"convex_hull": {"surface": {"file": "tet.obj"}}}]}},
    {"name": "tris", "rigid": {"shapes": [{"triangles": {"mesh": {"file": "tet.obj"}}}], "proxy_tets": 300}},
    {"name": "soft", "fem": {"mesh": {"enclosing": {"surface": {"file": "tet.obj"}, "tet_budget": 200}},
                             "render": {"file": "tet.obj"}}},
    {"name": "dent", "example": {"asset": {"default_rig": {"surface": {"file": "tet.obj"}, "tet_budget": 800}}}}
  ]})"));
  ASSERT_TRUE(loaded) << loaded.error().text();
  const auto& bodies = loaded->scene.bodies;
  EXPECT_EQ(std::get<sim::ConvexHull>(std::get<sim::RigidModel>(bodies.at(0).model).shapes.at(0).shape).points.size(),
            4u);
  EXPECT_TRUE(std::get<sim::RigidModel>(bodies.at(1).model).proxy);
  EXPECT_EQ(std::get<sim::FemModel>(bodies.at(2).model).render->triangles.size(), 4u);
  EXPECT_GT(std::get<sim::ExampleModel>(bodies.at(3).model).set->example_count(), 1);
}

TEST(SceneFile, AnAssetOfAnotherKindIsAnError) {
  const TemporaryFolder folder;
  folder.write("one.json", kTets);
  const auto loaded =
      load_scene(folder.write("s.json", R"({"bodies": [{"name": "a", "example": {"asset": {"file": "one.json"}}}]})"));
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().field, "bodies[0].example.asset.file");
  EXPECT_NE(loaded.error().message.find("must hold an example set"), std::string::npos) << loaded.error().text();
}

TEST(SceneFile, ListsTheScenesOfAFolder) {
  const TemporaryFolder folder;
  folder.write("b.json", "{}");
  folder.write("a.json", "{}");
  folder.write("readme.md", "");
  folder.write("sub/c.json", "{}");
  EXPECT_EQ(scene_names(folder.path()), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(scene_names(folder.path() / "none").empty());
}

class ShippedScene : public testing::TestWithParam<const char*> {};

TEST_P(ShippedScene, Loads) {
  const auto loaded =
      load_scene(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "deploy/scenes" / (std::string(GetParam()) + ".json"));
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(loaded->scene.name, GetParam());
  // A scene is for 2 cores: what moves fast must not pass through what is thin.
  for (const sim::BodyDescription& body : loaded->scene.bodies)
    EXPECT_LT(body.velocity.norm() * loaded->scene.dt, 0.13) << body.name;  // [m]; barrels are 0.64 m thick
}

INSTANTIATE_TEST_SUITE_P(SceneFile, ShippedScene, testing::Values("pane", "barrels", "cannonballs", "cannonballs_plain", "crash", "detention", "driver", "falling_cars", "gate", "pachinko", "pileup", "planks", "pole", "rope", "shipyard", "space", "trestle", "wall", "window"),
                         [](const auto& info) { return std::string(info.param); });

TEST(SceneFile, NoSceneIsShippedUntested) {
  EXPECT_EQ(scene_names(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "deploy/scenes"),
            (std::vector<std::string>{"barrels", "cannonballs", "cannonballs_plain", "crash", "detention", "driver", "falling_cars", "gate", "pachinko", "pane", "pileup", "planks", "pole", "rope", "shipyard", "space", "trestle", "wall", "window"}));
}

}  // namespace
}  // namespace crumple::io
