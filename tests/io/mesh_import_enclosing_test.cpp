#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/rig.h"
#include "server/io/mesh_import.h"
#include "server/sim/mesh/embedding.h"
#include "tests/support/shared_data.h"

#include <gtest/gtest.h>

// Real meshes: open, in many parts, self-intersecting. What is imported must be enclosed.
namespace crumple::io {
namespace {

class EverySharedMesh : public testing::TestWithParam<const char*> {};

TEST_P(EverySharedMesh, HasAllItsVerticesInsideTheEnclosingMesh) {
  CRUMPLE_NEED_SHARED("meshes");
  const auto surface = import_surface(test::shared_data("meshes") / GetParam());
  ASSERT_TRUE(surface) << surface.error().text();
  const auto made = authoring::enclosing_mesh(surface->mesh, {.tet_budget = 5000});
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_TRUE(sim::validate(made->mesh, "mesh"));
  EXPECT_LE(made->mesh.tet_count(), 5000);
  const sim::Embedding embedding = sim::embed(surface->mesh.vertices, made->mesh);
  int inside = 0;
  for (const Eigen::Vector4d& w : embedding.weights) inside += w.minCoeff() > -1e-8;
  EXPECT_EQ(inside, surface->mesh.vertices.size());
  RecordProperty("tets", made->mesh.tet_count());
  RecordProperty("bodies", made->report.bodies);
}

TEST(ImportedSurface, BecomesAnAssetThatDents) {
  CRUMPLE_NEED_SHARED("meshes");
  for (const char* name : {"kaykit_car_sedan.obj", "kaykit_barrel_large.glb", "vega_towerCrane_resol166.obj"}) {
    const auto surface = import_surface(test::shared_data("meshes") / name);
    ASSERT_TRUE(surface) << surface.error().text();
    const auto asset = authoring::make_default_asset(surface->mesh, {.enclosing = {.tet_budget = 1500}});
    ASSERT_TRUE(asset) << asset.error().text();
    EXPECT_TRUE(sim::example_based::validate(*asset, "asset"));
    EXPECT_EQ(asset->render.triangles.size(), surface->mesh.triangles.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, EverySharedMesh,
                         testing::Values("kaykit_car_sedan.obj", "kaykit_barrel_large.glb", "kaykit_barrel_small.glb",
                                         "kaykit_wall_cracked.glb", "kaykit_wall_gated.glb", "kaykit_pillar.glb",
                                         "kaykit_table_long.glb", "kaykit_lander_A.obj",
                                         "kenneykit_vehicle-truck-red.glb", "vega_simpleBridge.obj",
                                         "vega_towerCrane_resol166.obj", "vega_beam3_tet.obj", "od_spot_low.obj",
                                         "blender_rig_sample.glb"),
                         [](const auto& info) {
                           std::string name = info.param;
                           for (char& c : name)
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           return name;
                         });

}  // namespace
}  // namespace crumple::io
