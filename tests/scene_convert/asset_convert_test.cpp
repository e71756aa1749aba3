#include "server/scene_convert/asset_convert.h"

#include "server/authoring/barrel_asset.h"

#include <gtest/gtest.h>

namespace crumple::scene_convert {
namespace {

TEST(AssetConvert, ATetMeshComesBackEqual) {
  sim::TetMesh mesh{{Vec3(0.1, 0, 0), Vec3(1, 1e-9, 0), Vec3(0, 1, 0), Vec3(0, 0, 1.0 / 3)}, {{0, 1, 2, 3}}, {0.7}};
  const auto back = to_tet_mesh(to_message(mesh), "m");
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->X, mesh.X);
  EXPECT_EQ(back->tets, mesh.tets);
  EXPECT_EQ(back->fill, mesh.fill);
}

TEST(AssetConvert, ASurfaceComesBackEqual) {
  sim::SurfaceMesh mesh{{Vec3(0.1, 0, 0), Vec3(1, 2, 3), Vec3(0, 1, 0)}, {{2, 1, 0}}};
  const auto back = to_surface_mesh(to_message(mesh), "m");
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->triangles, mesh.triangles);
}

// Half of the weights zero at first, then all but one a row: both forms.
TEST(AssetConvert, AnExampleSetComesBackEqualInBothFormsOfItsWeights) {
  authoring::BarrelAsset coarse;
  coarse.cell_size = 0.3;
  const auto made = authoring::make_barrel_asset(coarse);
  ASSERT_TRUE(made) << made.error().text();
  sim::example_based::ExampleSet set = *made;
  for (int b = 0; b < set.bone_count(); ++b) set.handles.push_back({"bone " + std::to_string(b), Vec3(b, 1.0 / 3, -b)});
  set.alpha_scale.assign(set.vertex_count(), 0.25);
  for (int i = 0; i < set.vertex_count(); ++i) set.beta_scale.push_back(1 + 0.5 * i);
  for (const bool sparse : {false, true}) {
    if (sparse) {
      set.W.setZero();
      for (int i = 0; i < set.W.rows(); ++i) set.W(i, i % set.W.cols()) = 1;
    } else {
      set.W.setConstant(1.0 / static_cast<double>(set.W.cols()));
    }
    const v1::ExampleSet message = to_message(set);
    EXPECT_EQ(message.weights().has_sparse(), sparse);
    const auto back = to_example_set(message, "asset");
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(back->mesh.X, set.mesh.X);
    EXPECT_EQ(back->W, set.W);
    EXPECT_EQ(back->convex_parts, set.convex_parts);
    EXPECT_EQ(back->alpha_scale, set.alpha_scale);
    EXPECT_EQ(back->beta_scale, set.beta_scale);
    EXPECT_EQ(back->render.vertices, set.render.vertices);
    ASSERT_EQ(back->handles.size(), set.handles.size());
    for (std::size_t b = 0; b < set.handles.size(); ++b) {
      EXPECT_EQ(back->handles[b].name, set.handles[b].name);
      EXPECT_EQ(back->handles[b].position, set.handles[b].position);
    }
    ASSERT_EQ(back->example_count(), set.example_count());
    for (int e = 0; e < set.example_count(); ++e) {
      EXPECT_EQ(back->examples[e].name, set.examples[e].name);
      for (int b = 0; b < set.bone_count(); ++b) {
        EXPECT_EQ(back->examples[e].bones[b].q.coeffs(), set.examples[e].bones[b].q.coeffs());
        EXPECT_EQ(back->examples[e].bones[b].t, set.examples[e].bones[b].t);
      }
    }
  }
}

TEST(AssetConvert, ScalesOfAlphaAndBetaAreCheckedUnderTheirNames) {
  authoring::BarrelAsset coarse;
  coarse.cell_size = 0.3;
  v1::ExampleSet message = to_message(*authoring::make_barrel_asset(coarse));
  EXPECT_EQ(message.alpha_scale_size(), 0);
  message.add_beta_scale(2);
  const auto back = to_example_set(message, "asset");
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().field, "asset.beta_scale");
}

TEST(AssetConvert, PathsOfErrorsUseTheNamesOfTheMessage) {
  const auto named = [](const char* field) { return in_message_names({ErrorCode::invalid_argument, field, ""}).field; };
  EXPECT_EQ(named("bodies[1].fem.mesh.X[3]"), "bodies[1].fem.mesh.positions[3]");
  EXPECT_EQ(named("a.W[2][1]"), "a.weights[2][1]");
  EXPECT_EQ(named("a.examples[0].bones[4].q"), "a.examples[0].bones[4].rotation");
  EXPECT_EQ(named("a.examples[0].bones[4].t"), "a.examples[0].bones[4].translation");
  EXPECT_EQ(named("convex_parts[1][3]"), "convex_parts[1].vertices[3]");
  EXPECT_EQ(named("dt"), "dt");
}

}  // namespace
}  // namespace crumple::scene_convert
