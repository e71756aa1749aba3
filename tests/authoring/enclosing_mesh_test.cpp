#include "server/authoring/enclosing_mesh.h"

#include "server/authoring/shapes/surfaces.h"
#include "tests/authoring/surfaces_for_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <limits>
#include <numbers>

namespace crumple::authoring {
namespace {

using ::testing::HasSubstr;

double filled_volume(const sim::TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += mesh.fill[t] * sim::signed_volume(mesh, t);
  return sum;
}

bool encloses(const sim::TetMesh& mesh, const Vec3& p) {
  for (const Tet& t : mesh.tets) {
    Mat3 D;
    D << mesh.X[t[1]] - mesh.X[t[0]], mesh.X[t[2]] - mesh.X[t[0]], mesh.X[t[3]] - mesh.X[t[0]];
    const Vec3 b = D.inverse() * (p - mesh.X[t[0]]);
    if (b.minCoeff() > -1e-8 && b.sum() < 1 + 1e-8) return true;
  }
  return false;
}

void expect_encloses(const EnclosingMesh& made, const sim::SurfaceMesh& surface) {
  EXPECT_TRUE(sim::validate(made.mesh, "mesh"));
  EXPECT_EQ(made.mesh.fill.size(), made.mesh.tets.size());
  for (const Vec3& v : surface.vertices) EXPECT_TRUE(encloses(made.mesh, v)) << v.transpose();
}

TEST(EnclosingMesh, FilledVolumeOfASphereIsItsVolume) {
  const sim::SurfaceMesh sphere = icosphere(1, 4);
  for (const double h : {0.4, 0.2}) {
    const auto made = enclosing_mesh(sphere, {.cell_size = h});
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_NEAR(filled_volume(made->mesh) / (4 * std::numbers::pi / 3), 1, h * 0.1);  // 4 % and 2 %
    EXPECT_EQ(made->report.bodies, 1);
    EXPECT_EQ(made->report.cell_size, h);
  }
  expect_encloses(*enclosing_mesh(sphere, {.cell_size = 0.4}), sphere);
}

TEST(EnclosingMesh, FilledVolumeOfABoxIsItsVolumeHoweverItLiesInTheLattice) {
  const Pose turned{Quat(Eigen::AngleAxisd(0.35, Vec3(1, 2, 3).normalized())), Vec3(5, -3, 0.2)};
  for (const Pose& pose : {Pose{}, turned})
    for (const double h : {0.25, 0.19}) {
      sim::SurfaceMesh box;
      append(box, box_surface({1, 0.5, 0.5}), pose);
      const auto made = enclosing_mesh(box, {.cell_size = h});
      ASSERT_TRUE(made) << made.error().text();
      EXPECT_NEAR(filled_volume(made->mesh) / 2.0, 1, 0.03) << h;
      expect_encloses(*made, box);
    }
}

TEST(EnclosingMesh, InnerTetsAreFullAndCutOnesAreInBetween) {
  const auto made = enclosing_mesh(icosphere(1, 3), {.cell_size = 0.25});
  ASSERT_TRUE(made);
  for (int t = 0; t < made->mesh.tet_count(); ++t) {
    double far = 0, near = 10;
    for (const int node : made->mesh.tets[t]) {
      far = std::max(far, made->mesh.X[node].norm());
      near = std::min(near, made->mesh.X[node].norm());
    }
    if (far < 0.97) {
      EXPECT_EQ(made->mesh.fill[t], 1);
    }
    EXPECT_LT(near, 1.0);  // nothing that only comes near is kept
    EXPECT_GE(made->mesh.fill[t], 0.02);
  }
}

TEST(EnclosingMesh, AnOpenSheetKeepsTheFloorOfFill) {
  const sim::SurfaceMesh sheet = test::square_sheet();
  const auto made = enclosing_mesh(sheet, {.cell_size = 0.2, .minimum_fill = 0.05});
  ASSERT_TRUE(made) << made.error().text();
  expect_encloses(*made, sheet);
  EXPECT_EQ(made->report.cut_tets, made->mesh.tet_count());
  for (const double fill : made->mesh.fill) EXPECT_GE(fill, 0.05);
  EXPECT_GT(made->report.floored_tets, made->mesh.tet_count() / 2);
}

TEST(EnclosingMesh, AnOpenVesselIsSolidInside) {
  const sim::SurfaceMesh open = test::opened_above(icosphere(1, 4), 0.7);
  const auto made = enclosing_mesh(open, {.cell_size = 0.2});
  ASSERT_TRUE(made);
  expect_encloses(*made, open);
  EXPECT_GT(filled_volume(made->mesh), 0.85 * 4 * std::numbers::pi / 3);
  EXPECT_LT(filled_volume(made->mesh), 4 * std::numbers::pi / 3);
}

TEST(EnclosingMesh, SaysHowManyBodiesThereAre) {
  sim::SurfaceMesh two = box_surface({0.5, 0.5, 0.5});
  append(two, box_surface({0.5, 0.5, 0.5}), {Quat::Identity(), Vec3(3, 0, 0)});
  EXPECT_EQ(enclosing_mesh(two, {.cell_size = 0.3})->report.bodies, 2);
  EXPECT_EQ(enclosing_mesh(two, {.cell_size = 3})->report.bodies, 1);
}

TEST(EnclosingMesh, StaysWithinItsBudgetAndUsesMostOfIt) {
  for (const int budget : {300, 3000}) {
    const auto made = enclosing_mesh(icosphere(1, 3), {.tet_budget = budget});
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_LE(made->mesh.tet_count(), budget);
    EXPECT_GT(made->mesh.tet_count(), budget / 2);
  }
}

TEST(EnclosingMesh, IsTheSameEveryTime) {
  const auto a = enclosing_mesh(icosphere(1, 3)), b = enclosing_mesh(icosphere(1, 3));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->mesh.tets, b->mesh.tets);
  EXPECT_EQ(a->mesh.X, b->mesh.X);
  EXPECT_EQ(a->mesh.fill, b->mesh.fill);
}

TEST(EnclosingMesh, BadInputIsAnError) {
  const auto text = [](const Result<EnclosingMesh>& r) { return r ? std::string("no error") : r.error().text(); };
  const sim::SurfaceMesh sphere = icosphere(1, 1);
  EXPECT_THAT(text(enclosing_mesh({})), HasSubstr("surface.vertices is empty"));
  sim::SurfaceMesh broken = sphere;
  broken.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(text(enclosing_mesh(broken)), HasSubstr("surface.vertices[3] is not finite"));
  EXPECT_THAT(text(enclosing_mesh({{Vec3::Ones(), Vec3::Ones(), Vec3::Ones()}, {{0, 1, 2}}})), HasSubstr("no extent"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.cell_size = 0.027})), HasSubstr("cell_size is 0.027 m, which gives"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.cell_size = 1e-9})),
              HasSubstr("cell_size is 1e-09 m, which gives more than"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.cell_size = -1})), HasSubstr("cell_size is -1"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.tet_budget = 3})), HasSubstr("tet_budget is 3, must be at least"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.tet_budget = 0})), HasSubstr("tet_budget is 0"));
  EXPECT_THAT(text(enclosing_mesh(sphere, {.minimum_fill = 0})), HasSubstr("minimum_fill is 0"));
}

}  // namespace
}  // namespace crumple::authoring
