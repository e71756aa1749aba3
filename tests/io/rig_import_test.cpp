#include "server/io/rig_import.h"

#include "server/io/mesh_import.h"
#include "tests/support/glb_builder.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace crumple::io {
namespace {

using test::GlbBuilder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::json;

// A strip of two squares from x = 0 to 2 in the plane z = 0, bound to joints "low" at (0.5, 0, 0) and "high" at
// (1.5, 0, 0), which stand under the node "rig". `scale` is the rig's; the joints' own axes are turned about x by a
// quarter.
GlbBuilder strip(double scale = 1) {
  GlbBuilder glb;
  Json attributes;
  attributes["POSITION"] = glb.floats({0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 1, 1, 0, 2, 1, 0}, "VEC3");
  attributes["JOINTS_0"] =
      glb.add<std::uint8_t>({0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}, "VEC4", 5121);
  attributes["WEIGHTS_0"] =
      glb.floats({1, 0, 0, 0, .25f, .75f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, .5f, .5f, 0, 0, 1, 0, 0, 0}, "VEC4");
  const int indices = glb.add<std::uint16_t>({0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4}, "SCALAR", 5123);
  glb.document["meshes"] = {{{"primitives", {{{"attributes", attributes}, {"indices", indices}}}}}};
  // Joint axes: x, then y along z, z along -y. IBM = G^-1: the rows of R^T, then -R^T p.
  glb.document["skins"] = {{{"joints", {1, 2}},
                            {"inverseBindMatrices", glb.floats({1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, -.5f,  0, 0, 1,
                                                                1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, -1.5f, 0, 0, 1},
                                                               "MAT4")}}};
  const double s = std::sqrt(0.5);
  glb.document["nodes"] = {
      {{"name", "rig"}, {"children", {1, 3}}, {"scale", {scale, scale, scale}}},
      {{"name", "low"}, {"translation", {0.5, 0, 0}}, {"rotation", {s, 0, 0, s}}, {"children", {2}}},
      {{"name", "high"}, {"translation", {1, 0, 0}}},
      {{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}}};  // the specification: not looked at
  glb.document["scenes"] = {{{"nodes", {0}}}};
  return glb;
}

// An animation whose first key turns and moves one node.
void animate(GlbBuilder& glb, const std::string& name, int node, const std::string& path, const std::vector<float>& key,
             const std::string& interpolation = "LINEAR") {
  const int times = glb.floats({0.25f}, "SCALAR");
  const int values = glb.floats(key, path == "rotation" ? "VEC4" : path == "weights" ? "SCALAR" : "VEC3");
  Json& animations = glb.document["animations"];
  auto at = std::find_if(animations.begin(), animations.end(), [&](const Json& a) { return a["name"] == name; });
  if (at == animations.end()) {
    animations.push_back({{"name", name}, {"channels", Json::array()}, {"samplers", Json::array()}});
    at = animations.end() - 1;
  }
  (*at)["channels"].push_back({{"sampler", (*at)["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  (*at)["samplers"].push_back({{"input", times}, {"output", values}, {"interpolation", interpolation}});
}

Result<authoring::ArtistMesh> read(const std::string& bytes, ScaledJoints scaled = ScaledJoints::reject) {
  const test::TemporaryFolder folder;
  return import_artist_mesh(folder.write("rig.glb", bytes), scaled);
}

Vec3 moved(const authoring::ArtistMesh& mesh, int pose, int handle, const Vec3& x) {
  const auto& T = mesh.poses[pose].bones[handle];
  return T.q * x + T.t;
}

TEST(RigImport, JointsBecomeHandlesWhereTheyWereBound) {
  const auto mesh = read(strip().bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  ASSERT_EQ(mesh->handles.size(), 2u);
  EXPECT_EQ(mesh->parents, (std::vector<int>{-1, 0}));
  EXPECT_EQ(mesh->handles[0].name, "low");
  EXPECT_EQ(mesh->handles[1].name, "high");
  EXPECT_LT((mesh->handles[0].position - Vec3(0.5, 0, 0)).norm(), 1e-6);
  EXPECT_LT((mesh->handles[1].position - Vec3(1.5, 0, 0)).norm(), 1e-6);
  EXPECT_EQ(mesh->surface.vertices.size(), 6u);
  EXPECT_EQ(mesh->surface.triangles.size(), 4u);
  EXPECT_EQ(mesh->surface.vertices[1], Vec3(1, 0, 0)) << "a skinned mesh does not follow its node";
  EXPECT_EQ(mesh->weights(1, 0), 0.25);
  EXPECT_EQ(mesh->weights(1, 1), 0.75);
  EXPECT_TRUE(mesh->warnings.empty());
}

// Joint "low" turned by a quarter about the file's z, about its own place (0.5, 0, 0), carries "high" with it:
// (2, 0, 0) -> (0.5, 1.5, 0).
TEST(RigImport, AnimationsFirstKeyIsAPoseAboutTheOrigin) {
  GlbBuilder glb = strip();
  const float h = 0.5f;  // (quarter about z) times (quarter about x) = (1/2, 1/2, 1/2, 1/2) as x, y, z, w
  animate(glb, "turned", 1, "rotation", {h, h, h, h, 0, 0, 0, 1});
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  ASSERT_EQ(mesh->poses.size(), 1u);
  EXPECT_EQ(mesh->poses[0].name, "turned");
  for (int handle = 0; handle < 2; ++handle) {
    EXPECT_LT((moved(*mesh, 0, handle, {2, 0, 0}) - Vec3(0.5, 1.5, 0)).norm(), 1e-6);
    EXPECT_LT((moved(*mesh, 0, handle, {0.5, 1, 0}) - Vec3(-0.5, 0, 0)).norm(), 1e-6);
  }
}

TEST(RigImport, ARigsOwnScaleIsNoScaledJoint) {
  GlbBuilder glb = strip(0.01);
  animate(glb, "shifted", 2, "translation", {1, 0, -2});  // in axes whose -z is the file's y
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_LT((mesh->surface.vertices[2] - Vec3(0.02, 0, 0)).norm(), 1e-9);
  EXPECT_LT((mesh->handles[1].position - Vec3(0.015, 0, 0)).norm(), 1e-8);
  EXPECT_LT((moved(*mesh, 0, 1, {0.02, 0, 0}) - Vec3(0.02, 0.02, 0)).norm(), 1e-8);
  EXPECT_LT((moved(*mesh, 0, 0, {0.02, 0, 0}) - Vec3(0.02, 0, 0)).norm(), 1e-8);
}

TEST(RigImport, ASplinesFirstValueFollowsItsTangent) {
  GlbBuilder glb = strip();
  animate(glb, "spline", 2, "translation", {9, 9, 9, 1, 0, -2, 9, 9, 9}, "CUBICSPLINE");
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_LT((moved(*mesh, 0, 1, {0, 0, 0}) - Vec3(0, 2, 0)).norm(), 1e-6);
}

TEST(RigImport, NodesThatStandInAPoseDoNotChangeTheRestShape) {
  GlbBuilder glb = strip();
  glb.document["nodes"][2]["translation"] = {1, 0, -2};
  animate(glb, "bound", 2, "translation", {1, 0, 0});
  animate(glb, "as it stands", 1, "translation", {0.5, 0, 0});
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_LT((mesh->handles[1].position - Vec3(1.5, 0, 0)).norm(), 1e-6);
  ASSERT_EQ(mesh->poses.size(), 1u) << "the animation that takes the joints to where they were bound is the rest pose";
  EXPECT_EQ(mesh->poses[0].name, "as it stands");
  EXPECT_LT((moved(*mesh, 0, 1, {0, 0, 0}) - Vec3(0, 2, 0)).norm(), 1e-6);
  EXPECT_THAT(mesh->warnings, ElementsAre(HasSubstr("stand in a pose"), HasSubstr("\"bound\" moves no joint")));
}

TEST(RigImport, AScaledJointIsNamed) {
  GlbBuilder glb = strip();
  animate(glb, "squash", 2, "scale", {1, 0.5, 1});
  const auto rejected = read(glb.bytes());
  ASSERT_FALSE(rejected);
  EXPECT_THAT(rejected.error().text(),
              HasSubstr("rig.glb animation \"squash\" scales or shears joint \"high\" by 1 x 1 x 0.5"));
  const auto mesh = read(glb.bytes(), ScaledJoints::turn_only);
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_THAT(mesh->warnings, testing::Contains(HasSubstr("joint \"high\"")));
}

TEST(RigImport, ReadsEightWeightsAVertex) {
  GlbBuilder glb = strip();
  Json& attributes = glb.document["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_1"] = glb.add<std::uint16_t>(std::vector<std::uint16_t>(24, 0), "VEC4", 5123);
  attributes["WEIGHTS_1"] = glb.add<std::uint8_t>(
      {0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255}, "VEC4", 5121, true);
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_DOUBLE_EQ(mesh->weights(1, 0), 1.25 / 2);  // 0.25 + 1 of a sum of 2
  EXPECT_DOUBLE_EQ(mesh->weights(1, 1), 0.75 / 2);
}

TEST(RigImport, MorphTargetsAreNamedCopies) {
  GlbBuilder glb = strip();
  Json& mesh = glb.document["meshes"][0];
  const int dented = glb.floats({0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3");
  // Vertex 5 alone, as a sparse accessor without a view: zeros elsewhere.
  const int ids = glb.add_view<std::uint16_t>({5}), values = glb.add_view<float>({0, 3, 0});
  glb.document["accessors"].push_back({{"componentType", 5126},
                                       {"count", 6},
                                       {"type", "VEC3"},
                                       {"sparse",
                                        {{"count", 1},
                                         {"indices", {{"bufferView", ids}, {"componentType", 5123}}},
                                         {"values", {{"bufferView", values}}}}}});
  mesh["primitives"][0]["targets"] = {{{"POSITION", dented}}, {{"POSITION", dented + 1}}};
  mesh["extras"] = {{"targetNames", {"dented"}}};
  animate(glb, "half", 3, "weights", {0.5, 1});
  const auto read_back = read(glb.bytes());
  ASSERT_TRUE(read_back) << read_back.error().text();
  ASSERT_EQ(read_back->copies.size(), 3u);
  EXPECT_EQ(read_back->copies[0].name, "dented");
  EXPECT_EQ(read_back->copies[0].vertices[1], Vec3(1, 0, 2));
  EXPECT_EQ(read_back->copies[1].name, "morph 1");
  EXPECT_EQ(read_back->copies[1].vertices[5], Vec3(2, 4, 0));
  EXPECT_EQ(read_back->copies[1].vertices[1], Vec3(1, 0, 0));
  EXPECT_EQ(read_back->copies[2].name, "half");
  EXPECT_EQ(read_back->copies[2].vertices[1], Vec3(1, 0, 1));
  EXPECT_EQ(read_back->copies[2].vertices[5], Vec3(2, 4, 0));
}

TEST(RigImport, VerticesThatAMorphTargetPartsStayApart) {
  GlbBuilder glb;
  Json attributes{{"POSITION", glb.floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, -1, 0, 0}, "VEC3")}};
  const int target = glb.floats({0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0}, "VEC3");
  glb.document["meshes"] = {{{"primitives", {{{"attributes", attributes}, {"targets", {{{"POSITION", target}}}}}}}}};
  glb.document["nodes"] = {{{"mesh", 0}}};
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_EQ(mesh->surface.vertices.size(), 5u) << "(0, 1, 0) is one vertex, (0, 0, 0) two";
}

TEST(RigImport, ColoursAreLinearFractions) {
  GlbBuilder glb = strip();
  std::vector<std::uint8_t> colours(24, 0);
  colours[4] = 255, colours[6] = 51;
  glb.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = glb.add(colours, "VEC4", 5121, true);
  const auto mesh = read(glb.bytes());
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_EQ(mesh->colours[1], Vec3(1, 0, 0.2));
  EXPECT_EQ(mesh->colours[0], Vec3(0, 0, 0));
}

// ---- bad files ----------------------------------------------------------------------------------------------------
struct BadRig {
  std::string name, pointer;  // JSON pointer into the document
  Json value;                 // null: removed
  std::string says;
};

void PrintTo(const BadRig& bad, std::ostream* out) { *out << bad.name; }

class RigImportErrors : public testing::TestWithParam<BadRig> {};

TEST_P(RigImportErrors, NameThePlaceAndTheRule) {
  GlbBuilder glb = strip();
  animate(glb, "turned", 1, "rotation", {0, 0, 0, 1});
  const Json::json_pointer at(GetParam().pointer);
  if (GetParam().value.is_null())
    glb.document.at(at.parent_pointer()).erase(at.back());
  else
    glb.document[at] = GetParam().value;
  const auto mesh = read(glb.bytes());
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().text(), HasSubstr("rig.glb "));
  EXPECT_THAT(mesh.error().text(), HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Fields, RigImportErrors,
    testing::Values(
        BadRig{"NoPositions", "/meshes/0/primitives/0/attributes/POSITION", nullptr, "attributes.POSITION is missing"},
        BadRig{"AccessorOutOfRange", "/meshes/0/primitives/0/attributes/POSITION", 99,
               "attributes.POSITION is 99, must be an index below"},
        BadRig{"AccessorIsText", "/meshes/0/primitives/0/attributes/POSITION", "zero",
               "POSITION is \"zero\", must be an index"},
        BadRig{"WrongType", "/accessors/0/type", "VEC2", "accessors[0].type is \"VEC2\""},
        BadRig{"NoComponent", "/accessors/0/componentType", 5124, "accessors[0].componentType is 5124"},
        BadRig{"ViewOutOfRange", "/accessors/0/bufferView", 77, "accessors[0].bufferView is 77"},
        BadRig{"PastTheView", "/accessors/0/byteOffset", 8,
               "accessors[0] has 6 items, which reach past its bufferView"},
        BadRig{"PastTheBuffer", "/bufferViews/0/byteLength", 1000000,
               "accessors[0].bufferView reaches past its buffer"},
        BadRig{"TooFewVertices", "/accessors/0/count", 4, "has 6 items of JOINTS_0, must have 4"},
        BadRig{"TooFewWeights", "/accessors/2/count", 5, "has 5 items of WEIGHTS_0, must have 6"},
        BadRig{"NoWeights", "/meshes/0/primitives/0/attributes/WEIGHTS_0", nullptr, "attributes.WEIGHTS_0 is missing"},
        BadRig{"TooFewJoints", "/skins/0/joints", Json{1}, "JOINTS_0 is 1 at vertex 1, must be below 1"},
        BadRig{"JointTwice", "/skins/0/joints", Json{1, 1}, "skins[0].joints[1] names no node, or one twice"},
        BadRig{"NoSuchJoint", "/skins/0/joints", Json{1, 40}, "skins[0].joints[1] names no node"},
        BadRig{"NoJoint", "/skins/0/joints", Json::array(), "skins[0].joints must name at least one node"},
        BadRig{"TooFewMatrices", "/accessors/4/count", 1, "has 1 inverseBindMatrices, must have 2"},
        BadRig{"NoSkin", "/nodes/3/skin", 5, "nodes[3].skin is 5"},
        BadRig{"NoMesh", "/nodes/3/mesh", 5, "nodes[3].mesh is 5"},
        BadRig{"NoRotation", "/nodes/1/rotation", Json({0, 0, 0, 0}), "nodes[1].rotation must be a quaternion"},
        BadRig{"ShortTranslation", "/nodes/1/translation", Json({0, 0}), "nodes[1].translation must be 3 numbers"},
        BadRig{"NoSampler", "/animations/0/channels/0/sampler", 3, "animations[0].channels[0].sampler is 3"},
        BadRig{"NoOutput", "/animations/0/samplers/0/output", nullptr, "output is missing"},
        BadRig{"NoTarget", "/animations/0/channels/0/target/node", 8, "target.node is 8"},
        BadRig{"Compressed", "/extensionsRequired", Json({"KHR_draco_mesh_compression"}),
               "must be exported without compression"},
        BadRig{"NoTriangle", "/scenes/0/nodes", Json::array(), "has no triangle"}),
    [](const auto& info) { return info.param.name; });

TEST(RigImport, NumbersThatAreNotFiniteAreNamed) {
  GlbBuilder glb = strip();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(glb.binary.data() + 12, &nan, sizeof nan);
  const auto mesh = read(glb.bytes());
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().text(), HasSubstr("accessors[0] holds a number that is not finite, at item 1"));
}

TEST(RigImport, BuffersComeFromTheFilesFolderOnly) {
  const test::TemporaryFolder folder;
  GlbBuilder glb = strip();
  Json document = glb.document;
  folder.write("secret.bin", glb.binary);
  folder.write("rigs/own buffer.bin", glb.binary);
  const auto with_uri = [&](const std::string& uri) {
    document["buffers"] = {{{"byteLength", glb.binary.size()}, {"uri", uri}}};
    return import_artist_mesh(folder.write("rigs/rig.gltf", document.dump()));
  };
  const auto own = with_uri("own%20buffer.bin");
  ASSERT_TRUE(own) << own.error().text();
  EXPECT_EQ(own->handles.size(), 2u);
  for (const char* uri : {"../secret.bin", "%2e%2e/secret.bin", "/etc/passwd"}) {
    const auto refused = with_uri(uri);
    ASSERT_FALSE(refused) << uri;
    EXPECT_THAT(refused.error().text(), HasSubstr("folder or below it")) << uri;
  }
  std::filesystem::create_symlink(folder.path() / "secret.bin", folder.path() / "rigs/link.bin");
  EXPECT_FALSE(with_uri("link.bin"));
  const auto absent = with_uri("absent.bin");
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().text(), HasSubstr("absent.bin does not exist"));
}

// Whatever the bytes, an answer; the sanitizers' presets look for more.
TEST(RigImport, AnswersAnyBytes) {
  GlbBuilder glb = strip();
  animate(glb, "turned", 1, "rotation", {0, 0, 0, 1});
  const std::string sound = glb.bytes();
  std::mt19937 random(7);
  int refused = 0;
  for (int k = 0; k < 400; ++k) {
    std::string bytes = sound;
    for (int change = 0; change < 3; ++change) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (k % 4 == 0) bytes.resize(random() % bytes.size());
    refused += !read(bytes).has_value();
  }
  EXPECT_GT(refused, 200);
  EXPECT_LT(refused, 400);
}

// ---- other readers --------------------------------------------------------------------------------------------------
class RigSurface : public testing::TestWithParam<const char*> {};

// Assimp reads the same files (import_surface); it rounds placed vertices to floats, so that some may merge or not.
TEST_P(RigSurface, IsThatOfTheOtherReader) {
  CRUMPLE_NEED_SHARED("meshes");
  const auto file = test::shared_data("meshes") / GetParam();
  const auto mesh = import_artist_mesh(file);
  ASSERT_TRUE(mesh) << mesh.error().text();
  const auto other = import_surface(file);
  ASSERT_TRUE(other) << other.error().text();
  EXPECT_NEAR(static_cast<double>(mesh->surface.vertices.size()), static_cast<double>(other->mesh.vertices.size()),
              0.15 * other->mesh.vertices.size());
  ASSERT_EQ(mesh->surface.triangles.size(), other->mesh.triangles.size());
  double worst = 0;
  for (std::size_t t = 0; t < mesh->surface.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      worst = std::max(worst, (mesh->surface.vertices[mesh->surface.triangles[t][k]] -
                               other->mesh.vertices[other->mesh.triangles[t][k]])
                                  .norm());
  EXPECT_LT(worst, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Shared, RigSurface,
                         testing::Values("kaykit_barrel_large.glb", "kaykit_barrel_small.glb", "kaykit_pillar.glb",
                                         "kaykit_table_long.glb", "kaykit_wall_cracked.glb", "kaykit_wall_gated.glb",
                                         "kenneykit_vehicle-truck-red.glb", "blender_rig_sample.glb"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase_if(name, [](unsigned char c) { return !std::isalnum(c); });
                           return name;
                         });

// What Blender 3.4 exports of three bones and two actions.
TEST(RigImport, ReadsWhatBlenderExports) {
  CRUMPLE_NEED_SHARED("meshes");
  const auto mesh = import_artist_mesh(test::shared_data("meshes") / "blender_rig_sample.glb");
  ASSERT_TRUE(mesh) << mesh.error().text();
  ASSERT_EQ(mesh->handles.size(), 3u);
  for (int b = 0; b < 3; ++b) {
    EXPECT_EQ(mesh->handles[b].name, "h" + std::to_string(b));
    EXPECT_LT((mesh->handles[b].position - Vec3(0.5 * b, 0, 0)).norm(), 1e-6);
  }
  ASSERT_EQ(mesh->poses.size(), 1u);
  EXPECT_EQ(mesh->poses[0].name, "pose_crush");
  EXPECT_THAT(mesh->warnings, ElementsAre(HasSubstr("\"pose_rest\" moves no joint")));
  EXPECT_EQ(mesh->weights.rows(), static_cast<Eigen::Index>(mesh->surface.vertices.size()));
  EXPECT_LT((mesh->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
}

TEST(RigImport, ReadsFbx) {
  const test::TemporaryFolder folder;
  const auto obj = folder.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(obj.string(), 0);
  ASSERT_NE(scene, nullptr);
  Assimp::Exporter exporter;  // its binary form cannot be read by its own reader
  ASSERT_EQ(exporter.Export(scene, "fbxa", (folder.path() / "box.fbx").string()), aiReturn_SUCCESS);
  const auto mesh = import_artist_mesh(folder.path() / "box.fbx");
  ASSERT_TRUE(mesh) << mesh.error().text();
  ASSERT_EQ(mesh->surface.vertices.size(), 4u);
  EXPECT_EQ(mesh->surface.triangles.size(), 4u);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh->surface.vertices) box.extend(p);
  EXPECT_LT((box.max() - Vec3(1, 2, 3)).norm(), 1e-6);
}

}  // namespace
}  // namespace crumple::io
