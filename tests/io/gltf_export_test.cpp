#include "server/io/gltf_export.h"

#include "server/authoring/painted_regions.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/rig_pipeline.h"
#include "server/io/rig_import.h"
#include "server/sim/mesh/embedding.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace crumple::io {
namespace {

// A bar of 3 x 1 x 1 m, of 12 handles, posed and painted.
authoring::RiggedAsset bar() {
  authoring::ArtistMesh mesh;
  for (int k = 0; k < 8; ++k) mesh.surface.vertices.emplace_back(k & 1 ? 3 : 0, k & 2 ? 1 : 0, k & 4 ? 1 : 0);
  mesh.surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const Vec3& p : mesh.surface.vertices) mesh.colours.push_back(Vec3(p.x() / 3, 0, 0.5));
  authoring::RigOptions options{.enclosing = {.tet_budget = 800}, .keep_lattice = true};
  options.automatic_handles = 12;
  options.painted_regions = true;
  options.crushed = authoring::RigOptions::Crushed::always;
  options.poses = {
      {"bent & \"turned\"",
       {{.handle = "auto 1", .position = Vec3(0.2, 1.4, 0.3), .rotation = Quat(Eigen::AngleAxisd(0.7, Vec3::UnitZ()))},
        {.handle = "auto 12", .position = {}}}}};
  auto made = authoring::make_asset(mesh, options);
  EXPECT_TRUE(made) << made.error().text();
  return *std::move(made);
}

// Everything but the small weights comes back as floats: a part in 1e-6.
TEST(GltfExport, ComesBackAsTheSameRig) {
  const auto made = bar();
  const auto& set = made.set;
  std::vector<std::string> notes;
  const auto bytes = gltf_of(set, notes);
  ASSERT_TRUE(bytes) << bytes.error().text();
  const test::TemporaryFolder folder;
  const auto back = import_artist_mesh(folder.write("bar.glb", *bytes));
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_TRUE(back->warnings.empty()) << back->warnings[0];

  EXPECT_EQ(back->surface.triangles, set.render.triangles);
  ASSERT_EQ(back->handles.size(), set.handles.size());
  for (std::size_t b = 0; b < set.handles.size(); ++b) {
    EXPECT_EQ(back->handles[b].name, set.handles[b].name);
    EXPECT_LT((back->handles[b].position - set.handles[b].position).norm(), 1e-6);
  }
  ASSERT_EQ(back->poses.size() + 1, set.examples.size());
  for (std::size_t e = 1; e < set.examples.size(); ++e) {
    EXPECT_EQ(back->poses[e - 1].name, set.examples[e].name);
    for (std::size_t b = 0; b < set.handles.size(); ++b) {
      const auto &a = back->poses[e - 1].bones[b], &T = set.examples[e].bones[b];
      EXPECT_LT(a.q.angularDistance(T.q), 1e-6);
      EXPECT_LT((a.t - T.t).norm(), 5e-6);
    }
  }
  // The surface as the eight weights pose it, against the tets' skin.
  const auto x = authoring::skinned(set, set.examples.back().bones);
  std::vector<Vec3> drawn(set.render.vertices.size());
  sim::embedded_positions(sim::embed(set.render.vertices, set.mesh), set.mesh.tets, x, drawn);
  for (std::size_t v = 0; v < drawn.size(); ++v) {
    EXPECT_LE((back->weights.row(static_cast<Eigen::Index>(v)).array() > 0).count(), 8);
    EXPECT_NEAR(back->weights.row(static_cast<Eigen::Index>(v)).sum(), 1, 1e-12);
    Vec3 posed = Vec3::Zero();
    for (std::size_t b = 0; b < set.handles.size(); ++b) {
      const auto& T = back->poses.back().bones[b];
      posed += back->weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(b)) *
               (T.q * back->surface.vertices[v] + T.t);
    }
    EXPECT_LT((posed - drawn[v]).norm(), 0.05);  // a vertex of a corner hangs on nodes around it
    EXPECT_NEAR(back->colours[v].x(), back->surface.vertices[v].x() > 1 ? 1 : 0, 0.15);  // of the tet around the corner
    EXPECT_NEAR(back->colours[v].z(), 0.5, 1e-6);
  }
}

// Assimp, an independent reader, checks its own structures (its glTF reader knows JOINTS_0 alone).
TEST(GltfExport, AnotherReaderFindsItSound) {
  const auto made = bar();
  std::vector<std::string> notes;
  const auto bytes = gltf_of(made.set, notes);
  ASSERT_TRUE(bytes) << bytes.error().text();
  const test::TemporaryFolder folder;
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(folder.write("bar.glb", *bytes).string(), aiProcess_ValidateDataStructure);
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  EXPECT_EQ(scene->mFlags & (AI_SCENE_FLAGS_VALIDATION_WARNING | AI_SCENE_FLAGS_INCOMPLETE), 0u);
  ASSERT_EQ(scene->mNumMeshes, 1u);
  EXPECT_EQ(scene->mMeshes[0]->mNumFaces, 12u);
  EXPECT_EQ(scene->mMeshes[0]->mNumBones, 12u);
  EXPECT_TRUE(scene->mMeshes[0]->HasVertexColors(0));
  ASSERT_EQ(scene->mNumAnimations, 7u);
  std::set<std::string> names;
  for (unsigned a = 0; a < 7; ++a) names.insert(scene->mAnimations[a]->mName.C_Str());
  EXPECT_TRUE(names.contains("bent & \"turned\""));
  EXPECT_TRUE(names.contains("crushed_min_x"));
  for (unsigned b = 0; b < 12; ++b) {
    const aiBone& bone = *scene->mMeshes[0]->mBones[b];
    const auto at =
        std::ranges::find(made.set.handles, std::string(bone.mName.C_Str()), &sim::example_based::Handle::name);
    ASSERT_NE(at, made.set.handles.end());
    EXPECT_NEAR(bone.mOffsetMatrix.a4, -at->position.x(), 1e-6);
    EXPECT_NEAR(bone.mOffsetMatrix.b4, -at->position.y(), 1e-6);
    EXPECT_NEAR(bone.mOffsetMatrix.c4, -at->position.z(), 1e-6);
  }
}

TEST(GltfExport, OfManyWeightsTheEightLargestStay) {
  auto set = bar().set;
  set.W.setConstant(1.0 / 12);
  std::vector<std::string> notes;
  const auto bytes = gltf_of(set, notes);
  ASSERT_TRUE(bytes) << bytes.error().text();
  EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("leave out up to 33.3333 %")));
  const test::TemporaryFolder folder;
  const auto back = import_artist_mesh(folder.write("bar.glb", *bytes));
  ASSERT_TRUE(back) << back.error().text();
  for (Eigen::Index v = 0; v < back->weights.rows(); ++v)
    for (Eigen::Index b = 0; b < 12; ++b) EXPECT_NEAR(back->weights(v, b), b < 8 ? 0.125 : 0, 1e-7);
}

TEST(GltfExport, SetsWithoutHandlesOrSurfaceAreWrittenToo) {
  auto set = bar().set;
  set.handles.clear();
  set.render = {};
  set.alpha_scale.clear();
  set.beta_scale.clear();
  std::vector<std::string> notes;
  const auto bytes = gltf_of(set, notes);
  ASSERT_TRUE(bytes) << bytes.error().text();
  const test::TemporaryFolder folder;
  const auto back = import_artist_mesh(folder.write("bar.glb", *bytes));
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->handles[3].name, "bone 3");
  EXPECT_TRUE(back->colours.empty());
  for (std::size_t b = 0; b < back->handles.size(); ++b)
    EXPECT_LT((back->poses[0].bones[b].t - set.examples[1].bones[b].t).norm(), 5e-6)
        << "about the origin, wherever the joint is";
}

}  // namespace
}  // namespace crumple::io
