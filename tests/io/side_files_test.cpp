#include "server/io/side_files.h"

#include "server/io/mesh_import.h"
#include "server/io/scene_file.h"
#include "server/io/tet_import.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <cstring>

namespace crumple::io {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

// One triangle, its nine floats in a file.
std::string gltf(const std::string& uri) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": ")" +
         uri + "\"}]}";
}

std::string nine_floats() {
  const float x[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::string bytes(sizeof x, '\0');
  std::memcpy(bytes.data(), x, sizeof x);
  return bytes;
}

template <class Imported>
std::string text_of(const Result<Imported>& result) {
  if (result) return "no error";
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument) << result.error().text();
  return result.error().text();
}

TEST(SideFiles, AFileThatIsNotThereYetLiesWhereItWould) {
  EXPECT_TRUE(lies_inside("not yet.bin", "."));
  EXPECT_TRUE(lies_inside("not yet/a.bin", ""));
  EXPECT_FALSE(lies_inside("../not yet.bin", "."));
}

TEST(SideFiles, NamesInsideAreRelativeWithoutDots) {
  for (const char* name : {"a.bin", "sub/a.bin", "./a.bin", "..a", "a..b/c"}) EXPECT_TRUE(is_inside_name(name)) << name;
  for (const char* name : {"", "..", "../a.bin", "sub/../../a.bin", "/a.bin", "sub/.."})
    EXPECT_FALSE(is_inside_name(name)) << name;
  EXPECT_FALSE(is_inside_name(std::string_view("a\0b", 3)));
}

TEST(SideFiles, OfAGltfAreReadFromItsFolderAndBelow) {
  const TemporaryFolder folder;
  folder.write("meshes/a.bin", nine_floats());
  folder.write("meshes/sub/b.bin", nine_floats());
  for (const char* uri : {"a.bin", "sub/b.bin"}) {
    const auto surface = import_surface(folder.write("meshes/m.gltf", gltf(uri)));
    ASSERT_TRUE(surface) << surface.error().text();
    EXPECT_EQ(surface->mesh.triangles.size(), 1u);
    EXPECT_EQ(surface->mesh.vertices[1], Vec3(1, 0, 0));
  }
}

TEST(SideFiles, OfAGltfOutsideItsFolderAreErrors) {
  const TemporaryFolder folder;
  const auto outside = folder.write("secret.bin", nine_floats());
  std::filesystem::create_directories(folder.path() / "meshes");
  for (const std::string& uri : {std::string("../secret.bin"), outside.string(), "file://" + outside.string(),
                                 std::string("x/../../secret.bin"), std::string("../nowhere.bin")}) {
    const auto surface = import_surface(folder.write("meshes/m.gltf", gltf(uri)));
    EXPECT_THAT(text_of(surface), HasSubstr("m.gltf buffers[0].uri is \"" + uri + "\", must be a relative path"))
        << uri;
  }
  // What the name does not show: percent signs and links.
  std::filesystem::create_symlink(outside, folder.path() / "meshes/link.bin");
  EXPECT_THAT(text_of(import_surface(folder.write("meshes/m.gltf", gltf("link.bin")))),
              HasSubstr("\"link.bin\", must name files in its folder"));
  EXPECT_NE(text_of(import_surface(folder.write("meshes/m.gltf", gltf("%2e%2e/secret.bin")))), "no error");
  const std::string image = R"({"asset": {"version": "2.0"}, "images": [{"uri": "../../x.png"}]})";
  EXPECT_THAT(text_of(import_surface(folder.write("meshes/i.gltf", image))), HasSubstr("images[0].uri"));
}

TEST(SideFiles, ThatAreNoFilesAreErrors) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "dir.bin");
  ASSERT_EQ(mkfifo((folder.path() / "pipe.bin").c_str(), 0600), 0);  // opening it would wait for ever
  for (const char* uri : {"dir.bin", "pipe.bin", "absent.bin"})
    EXPECT_THAT(text_of(import_surface(folder.write("m.gltf", gltf(uri)))), HasSubstr("m.gltf cannot be read")) << uri;
}

TEST(SideFiles, OfAnObjAreNotOpenedAndMayNotLieOutside) {
  const TemporaryFolder folder;
  folder.write("secret.mtl", "newmtl a\n");
  EXPECT_THAT(text_of(import_surface(folder.write("meshes/m.obj", "mtllib ../secret.mtl\n" + kObj))),
              HasSubstr("m.obj names the file \"../secret.mtl\", must name files in its folder"));
  ASSERT_EQ(mkfifo((folder.path() / "meshes/pipe.mtl").c_str(), 0600), 0);
  for (const char* harmless : {"absent.mtl", "pipe.mtl"}) {
    const auto surface = import_surface(folder.write("meshes/m.obj", std::string("mtllib ") + harmless + "\n" + kObj));
    ASSERT_TRUE(surface) << surface.error().text();
    EXPECT_EQ(surface->mesh.triangles.size(), 4u);
  }
}

TEST(SideFiles, OfTetGenMayNotLinkOut) {
  const TemporaryFolder folder;
  folder.write("meshes/t.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
  const auto outside = folder.write("t.ele", "1 4 0\n0 0 1 2 3\n");
  std::filesystem::create_symlink(outside, folder.path() / "meshes/t.ele");
  EXPECT_THAT(text_of(import_tets(folder.path() / "meshes/t.node")),
              HasSubstr("t.ele is a link that leads out of its folder"));
}

// The whole way: the error names the scene's field first.
TEST(SideFiles, AreTheFaultOfTheFieldThatNamesTheMesh) {
  const TemporaryFolder folder;
  folder.write("secret.mtl", "newmtl a\n");
  folder.write("scenes/m.obj", "mtllib ../secret.mtl\n" + kObj);
  const auto loaded = load_scene(folder.write("scenes/s.json", R"({"bodies": [{"name": "b", "rigid": {"shapes": [
      {"convex_hull": {"surface": {"file": "m.obj"}}}]}}]})"));
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(loaded.error().field, "bodies[0].rigid.shapes[0].convex_hull.surface.file");
  EXPECT_THAT(loaded.error().message, HasSubstr("m.obj names the file \"../secret.mtl\""));
}

}  // namespace
}  // namespace crumple::io
