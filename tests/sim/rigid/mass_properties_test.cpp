#include "server/sim/rigid/mass_properties.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/sim/rigid/primitive_meshes.h"

namespace crumple::sim {
namespace {

const Pose kPose{Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())), {0.3, -2, 5}};

void expect_same(const MassProperties& a, const MassProperties& b, double tolerance) {
  EXPECT_NEAR(a.mass, b.mass, tolerance * b.mass);
  EXPECT_LT((a.com - b.com).norm(), tolerance * (1 + b.com.norm()));
  EXPECT_LT((a.inertia - b.inertia).norm(), tolerance * b.inertia.norm());
}

TEST(MassProperties, BoxOfTwoByFourBySix) {  // m (b^2 + c^2) / 12
  const MassProperties box = box_mass({1, 2, 3}, 0.5);
  EXPECT_DOUBLE_EQ(box.mass, 24);
  EXPECT_LT((box.inertia.diagonal() - Vec3(104, 80, 40)).norm(), 1e-12);
}

TEST(MassProperties, CylinderAlongY) {  // m r^2/2 along, m (3 r^2 + l^2)/12 across
  const MassProperties cylinder = cylinder_mass(0.5, 1.5, 1);
  const double m = 0.75 * std::numbers::pi;
  EXPECT_NEAR(cylinder.mass, m, 1e-12);
  EXPECT_NEAR(cylinder.inertia(1, 1), m / 8, 1e-12);
  EXPECT_NEAR(cylinder.inertia(0, 0), m * (0.75 + 9) / 12, 1e-12);
}

TEST(MassProperties, ClosedMeshOfABoxIsTheBoxWhereverItIs) {
  SurfaceMesh mesh = box_surface({1, 2, 3});
  for (Vec3& v : mesh.vertices) v = kPose * v;
  expect_same(closed_mesh_mass(mesh, 7), placed(box_mass({1, 2, 3}, 7), kPose), 1e-13);
}

TEST(MassProperties, FineIcosphereTendsToTheSphere) {  // 20480 triangles: error of second order in the edge
  expect_same(closed_mesh_mass(icosphere(2, 5), 3), sphere_mass(2, 3), 2.5e-3);
  const double coarse = sphere_mass(2, 3).mass - closed_mesh_mass(icosphere(2, 3), 3).mass;
  const double fine = sphere_mass(2, 3).mass - closed_mesh_mass(icosphere(2, 4), 3).mass;
  EXPECT_NEAR(coarse / fine, 4, 0.1);
}

TEST(MassProperties, CylinderSurfaceTendsToTheCylinder) {
  expect_same(closed_mesh_mass(cylinder_surface(0.5, 1.5, 400), 1), cylinder_mass(0.5, 1.5, 1), 2e-4);
}

// A cube of 2 m cut into six tets about a diagonal, at 100 kg/m^3; one tet filled by half.
TEST(MassProperties, TetsOfABoxAreTheBox) {
  TetMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.X.push_back(kPose * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  mesh.tets = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  const std::vector<double> masses = tet_masses(mesh, 100);
  expect_same(tet_mass(mesh.tets, mesh.X, masses), placed(box_mass({1, 1, 1}, 100), kPose), 1e-13);

  mesh.fill = {0.5, 1, 1, 1, 1, 1};
  const std::vector<double> less = tet_masses(mesh, 100);
  EXPECT_NEAR(tet_mass(mesh.tets, mesh.X, less).mass, 800 - 800.0 / 12, 1e-9);
}

TEST(MassProperties, ShrinkingTetsKeepTheirMass) {  // F11: I times 0.64
  TetMesh mesh{.X = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, .tets = {{0, 1, 2, 3}}, .fill = {}};
  const std::vector<double> masses = tet_masses(mesh, 10);
  const MassProperties before = tet_mass(mesh.tets, mesh.X, masses);
  for (Vec3& x : mesh.X) x *= 0.8;
  const MassProperties after = tet_mass(mesh.tets, mesh.X, masses);
  EXPECT_DOUBLE_EQ(after.mass, before.mass);
  EXPECT_LT((after.inertia - 0.64 * before.inertia).norm(), 1e-14 * before.inertia.norm() * 10);
}

TEST(MassProperties, PointsOfADumbbell) {
  const std::vector<Vec3> x{{0, 0, 0}, {0, 3, 0}};
  const std::vector<double> m{2, 1};
  const MassProperties dumbbell = point_mass(x, m);
  EXPECT_LT((dumbbell.com - Vec3(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((dumbbell.inertia - Mat3(Vec3(6, 0, 6).asDiagonal())).norm(), 1e-14);
}

TEST(MassProperties, HalvesOfABoxMakeTheBox) {
  const std::vector<PlacedShape> halves{{Pose{Quat::Identity(), {-0.5, 0, 0}}, Box{{0.5, 2, 3}}},
                                        {Pose{Quat::Identity(), {0.5, 0, 0}}, Box{{0.5, 2, 3}}}};
  expect_same(*shapes_mass(halves, 7, ""), box_mass({1, 2, 3}, 7), 1e-14);
}

TEST(MassProperties, HullOfABoxIsTheBox) {
  ConvexHull hull{box_surface({1, 2, 3}).vertices};
  hull.points.push_back({0.1, 0.2, 0.3});  // inside
  expect_same(*shapes_mass({{kPose, hull}}, 7, ""), placed(box_mass({1, 2, 3}, 7), kPose), 1e-13);
}

TEST(MassProperties, WhatHasNoVolumeIsAnErrorThatNamesTheShape) {
  const std::vector<Vec3> flat{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const auto error_of = [](const Shape& shape) {
    const Result<MassProperties> result = shapes_mass({{Pose{}, Box{}}, {Pose{}, shape}}, 1, "body.shapes");
    return result ? "" : result.error().field;
  };
  EXPECT_EQ(error_of(ConvexHull{flat}), "body.shapes[1]");
  EXPECT_EQ(error_of(TriangleShape{{flat, {{0, 1, 3}, {0, 3, 2}}}}), "body.shapes[1]");
  EXPECT_EQ(error_of(Plane{}), "body.shapes[1]");
  EXPECT_EQ(error_of(Sphere{}), "");
  EXPECT_FALSE(shapes_mass({}, 1, "body.shapes"));
}

TEST(PrincipalAxes, DiagonaliseAndStayNearestToTheBodysAxes) {
  for (const double angle : {0.0, 0.05, 0.5, 1.2, 2.0, 3.1}) {
    const Mat3 R = Eigen::AngleAxisd(angle, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    const Mat3 inertia = R * Vec3(5, 1, 3).asDiagonal() * R.transpose();
    const PrincipalAxes axes = principal_axes(inertia);
    EXPECT_NEAR(axes.R_BP.determinant(), 1, 1e-12);
    EXPECT_LT((axes.R_BP * axes.moments.asDiagonal() * axes.R_BP.transpose() - inertia).norm(), 1e-12);
    if (angle < 0.6) {
      EXPECT_LT((axes.R_BP - R).norm(), 1e-12) << angle;  // a small turn: the turned axes themselves
      EXPECT_LT((axes.moments - Vec3(5, 1, 3)).norm(), 1e-12);
    }
  }
  EXPECT_TRUE(principal_axes(Vec3(3, 1, 2).asDiagonal()).R_BP.isIdentity(0));
}

TEST(PrincipalAxes, ANeedleHasAnInverse) {
  EXPECT_GT(principal_axes(Vec3(1, 0, 1).asDiagonal()).moments.minCoeff(), 0);
}

}  // namespace
}  // namespace crumple::sim
