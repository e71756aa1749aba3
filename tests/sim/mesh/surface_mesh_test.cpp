#include "server/sim/mesh/surface_mesh.h"

#include <gtest/gtest.h>

#include <limits>

namespace crumple::sim {
namespace {

SurfaceMesh triangle() { return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}}}; }

TEST(SurfaceMesh, ValidateAcceptsAnOpenSurface) { EXPECT_TRUE(validate(triangle(), "render")); }

TEST(SurfaceMesh, ValidateNamesTheBreach) {
  SurfaceMesh mesh = triangle();
  mesh.triangles[0][1] = 3;
  EXPECT_EQ(validate(mesh, "render").error().text(), "render.triangles[0] names vertex 3, must be in [0, 3)");
  mesh = triangle();
  mesh.vertices[2][0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(validate(mesh, "render").error().text(), "render.vertices[2] is not finite");
  EXPECT_EQ(validate(SurfaceMesh{}, "render").error().text(), "render.vertices is empty");
  mesh = triangle();
  mesh.triangles.clear();
  EXPECT_EQ(validate(mesh, "render").error().text(), "render.triangles is empty");
  mesh.triangles.resize(5'000'001, {0, 1, 2});
  EXPECT_FALSE(validate(mesh, "render"));
}

}  // namespace
}  // namespace crumple::sim
