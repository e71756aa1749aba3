#include "server/sim/rigid/proxy.h"

#include <gtest/gtest.h>

#include <numbers>

#include "server/sim/rigid/mass_properties.h"
#include "server/sim/rigid/primitive_meshes.h"

namespace crumple::sim {
namespace {

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (const double v : tet_masses(mesh, 1)) {
    EXPECT_GT(v, 0);
    sum += v;
  }
  return sum;
}

TEST(ProxyTets, FillTheShapes) {
  EXPECT_EQ(proxy_tets({{Pose{}, Box{{1, 2, 3}}}})->tet_count(), 12);
  EXPECT_NEAR(volume(*proxy_tets({{Pose{}, Box{{1, 2, 3}}}})), 48, 1e-12);
  EXPECT_EQ(proxy_tets({{Pose{}, Sphere{2}}})->tet_count(), 80);
  EXPECT_NEAR(volume(*proxy_tets({{Pose{}, Sphere{2}}})), 32 * std::numbers::pi / 3, 1e-12);
  EXPECT_NEAR(volume(*proxy_tets({{Pose{}, Cylinder{2, 3}}})), 24 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(volume(*proxy_tets({{Pose{}, ConvexHull{box_surface({1, 2, 3}).vertices}}})), 48, 1e-12);
}

TEST(ProxyTets, CompoundIsTheUnionWhereItsPartsAre) {
  const Pose apart{Quat(Eigen::AngleAxisd(1, Vec3::UnitX())), {5, 0, 0}};
  const TetMesh tets = *proxy_tets({{Pose{}, Box{{1, 1, 1}}}, {apart, Box{{1, 2, 3}}}});
  EXPECT_EQ(tets.tet_count(), 24);
  const MassProperties solid = tet_mass(tets.tets, tets.X, tet_masses(tets, 1));
  EXPECT_NEAR(solid.mass, 56, 1e-12);
  EXPECT_NEAR(solid.com.x(), 5 * 48 / 56.0, 1e-12);
}

TEST(ProxyTets, PlanesNeedNoneAndTrianglesHaveNone) {
  EXPECT_EQ(proxy_tets({{Pose{}, Plane{}}})->tet_count(), 0);
  EXPECT_FALSE(proxy_tets({{Pose{}, Box{}}, {Pose{}, TriangleShape{box_surface({1, 1, 1})}}}));
}

TEST(DrawMesh, IsClosedAndOutwardForSolids) {
  EXPECT_NEAR(enclosed_volume(draw_mesh({{Pose{}, Box{{1, 2, 3}}}})), 48, 1e-12);
  EXPECT_NEAR(enclosed_volume(draw_mesh({{Pose{}, Sphere{1}}})), 4 * std::numbers::pi / 3, 0.04);
  EXPECT_NEAR(enclosed_volume(draw_mesh({{Pose{}, Cylinder{1, 1}}})), 2 * std::numbers::pi, 0.05);
  EXPECT_NEAR(enclosed_volume(draw_mesh({{Pose{}, ConvexHull{box_surface({1, 2, 3}).vertices}}})), 48, 1e-12);
}

TEST(DrawMesh, PlaneFacesItsNormal) {
  const SurfaceMesh mesh = draw_mesh({{Pose{}, Plane{{0, 2, 0}, 3}}});  // 2 y = 3
  EXPECT_EQ(mesh.triangles.size(), 200u);
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 n = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]) / 2;
    EXPECT_NEAR(n.normalized().y(), 1, 1e-12);
    area += n.norm();
  }
  EXPECT_NEAR(area, 400, 1e-9);
  double reach = 0;
  for (const Vec3& v : draw_mesh({{Pose{}, Plane{{0, 2, 0}, 3}}}, 70).vertices) reach = std::max({reach, std::abs(v.x()), std::abs(v.z())});
  EXPECT_NEAR(reach, 70, 1e-9);
  EXPECT_NEAR(mesh.vertices[0].y(), 1.5, 1e-12);
}

}  // namespace
}  // namespace crumple::sim
