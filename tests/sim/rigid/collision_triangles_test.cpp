#include "server/sim/rigid/collision_triangles.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/sim/rigid/primitive_meshes.h"

namespace crumple::sim {
namespace {

TEST(SoundTriangles, DropsWhatHasNoAreaOrIsThereTwice) {  // STABILITY row 35
  SurfaceMesh mesh = box_surface({1, 1, 1});
  mesh.vertices.push_back({0, 1, 1});
  mesh.vertices.push_back({-1, -1, -1});                                      // 9: again where 0 is
  mesh.vertices.push_back({std::numeric_limits<double>::quiet_NaN(), 0, 0});  // 10
  mesh.vertices.push_back({0, 1 + 1e-7, 1});                                  // 11
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({6, 8, 7});   // on a line
  mesh.triangles.push_back({6, 11, 7});  // 2e7 times as long as high
  mesh.triangles.push_back({4, 6, 9});   // the first one with another name for a corner
  mesh.triangles.push_back({0, 1, 10});
  EXPECT_EQ(sound_triangles(mesh), box_surface({1, 1, 1}).triangles);
}

TEST(EdgeShape, RimsStickOutAndFlatDiagonalsAndNotchesDoNot) {
  const SurfaceMesh box = box_surface({1, 1, 1});
  const EdgeShape edges(box.vertices, box.triangles);
  const int top = 6;                                                              // {2, 6, 7}, of the face y = 1
  EXPECT_FALSE(edges.on_ridge(top, {0, 1, 0}, Vec3(1, 0.1, 0).normalized()));     // on the diagonal
  EXPECT_TRUE(edges.on_ridge(top, {0, 1, 1}, Vec3(0, 1, 1).normalized()));        // on the rim
  EXPECT_FALSE(edges.on_ridge(top, {0, 1, 1}, Vec3(0, -1, -1).normalized()));     // seen from inside: a notch
  EXPECT_FALSE(edges.on_ridge(top, {-0.1, 1, 0.5}, Vec3(1, 1, 0).normalized()));  // on the face
}

}  // namespace
}  // namespace crumple::sim
