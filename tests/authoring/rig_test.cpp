#include "server/authoring/rig.h"

#include "server/authoring/barrel_asset.h"
#include "server/authoring/boundary_fit.h"
#include "server/authoring/car_asset.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/shapes/surfaces.h"
#include "server/authoring/surface_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

namespace crumple::authoring {
namespace {

using sim::example_based::ExampleSet;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> names(const ExampleSet& set) {
  std::vector<std::string> out;
  for (const auto& example : set.examples) out.push_back(example.name);
  return out;
}

std::vector<Vec3> posed(const ExampleSet& set, int e) {
  std::vector<Vec3> x(set.vertex_count(), Vec3::Zero());
  for (int i = 0; i < set.vertex_count(); ++i)
    for (int b = 0; b < set.bone_count(); ++b)
      x[i] += set.W(i, b) * (set.examples[e].bones[b].q * set.mesh.X[i] + set.examples[e].bones[b].t);
  return x;
}

Eigen::AlignedBox3d box_of(const std::vector<Vec3>& x) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : x) box.extend(p);
  return box;
}

double filled_volume(const sim::TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += mesh.fill[t] * sim::signed_volume(mesh, t);
  return sum;
}

// Share of the tets that a pose turns inside out.
double inverted_share(const ExampleSet& set, int e) {
  sim::TetMesh mesh = set.mesh;
  mesh.X = posed(set, e);
  int inverted = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) inverted += sim::signed_volume(mesh, t) <= 0;
  return static_cast<double>(inverted) / mesh.tet_count();
}

// ---- bones
// --------------------------------------------------------------------------------------------------------------
TEST(PlaceHandles, LeavesTheCornersOfABox) {
  const auto enclosed = enclosing_mesh(box_surface({1, 0.6, 0.6}), {.cell_size = 0.2});
  const sim::TetMesh mesh = fitted_to_surface(*enclosed, box_surface({1, 0.6, 0.6}));
  const auto handles = place_handles(mesh, surface_nodes(mesh.tets), 8);
  ASSERT_EQ(handles.size(), 8u);
  double closest = 1e9;
  for (const int a : handles)
    for (const int b : handles)
      if (a != b) closest = std::min(closest, (mesh.X[a] - mesh.X[b]).norm());
  EXPECT_GT(closest, 0.8);  // 8 points on a 2 x 1.2 x 1.2 box: not two near each other
}

TEST(PlaceHandles, GivenOnesStayAndKeepOthersAway) {
  const sim::TetMesh mesh = enclosing_mesh(icosphere(1, 3), {.cell_size = 0.25})->mesh;
  const auto surface = surface_nodes(mesh.tets);
  const Vec3 given(1, 0, 0);
  double before = 1e9;  // how near the others come to it
  for (const int id : place_handles(mesh, surface, 12)) before = std::min(before, (mesh.X[id] - given).norm());
  const auto added = place_handles(mesh, surface, 12, {.given = {given}});
  EXPECT_EQ(added.size(), 12u);
  double closest = 1e9, apart = 1e9;
  for (const int a : added) {
    closest = std::min(closest, (mesh.X[a] - given).norm());
    for (const int b : added)
      if (a != b) apart = std::min(apart, (mesh.X[a] - mesh.X[b]).norm());
  }
  EXPECT_GT(closest, before);
  EXPECT_GT(closest, 0.9 * apart);  // as far as they are from each other
  EXPECT_TRUE(place_handles(mesh, surface, 0, {.given = {given}}).empty());
}

TEST(PlaceHandles, OneVariantKeepsWhatIsNearTheBox) {
  // Two rows of points, one of them on the box: each pair across is the closest there is.
  sim::TetMesh mesh;
  for (int k = 0; k <= 4; ++k) {
    mesh.X.push_back({1.0 * k, 0, 0});
    mesh.X.push_back({1.0 * k, 0.1, 0.1});
  }
  mesh.X.push_back({0, 5, 5});  // only for the box
  const std::vector<int> ids{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_THAT(place_handles(mesh, ids, 5), ElementsAre(0, 2, 4, 6, 8));
  EXPECT_THAT(place_handles(mesh, ids, 5, {.keep = KeepHandle::arbitrary}), ElementsAre(1, 3, 5, 7, 9));
}

TEST(FarthestPoints, OfALineAreItsEndsAndItsMiddle) {
  std::vector<Vec3> X;
  std::vector<int> ids;
  for (int k = 0; k <= 8; ++k) {
    X.push_back({k * 1.0, 0, 0});
    ids.push_back(k);
  }
  EXPECT_THAT(farthest_points(X, ids, 3), ElementsAre(0, 8, 4));
  EXPECT_EQ(farthest_points(X, ids, 99).size(), 9u);
}

// ---- the mesh drawn onto its surface
// --------------------------------------------------------------------------------------
TEST(FittedToSurface, BringsTheBoundaryToTheSurface) {
  const sim::SurfaceMesh sphere = icosphere(1, 4);
  const auto enclosed = enclosing_mesh(sphere, {.cell_size = 0.25});
  const sim::TetMesh mesh = fitted_to_surface(*enclosed, sphere);
  EXPECT_TRUE(sim::validate(mesh, "mesh"));
  const SurfaceDistance distance(sphere);
  double mean = 0, worst = 0;
  const auto boundary = surface_nodes(mesh.tets);
  for (const int node : boundary) {
    mean += distance(mesh.X[node]) / static_cast<double>(boundary.size());
    worst = std::max(worst, distance(mesh.X[node]));
  }
  EXPECT_LT(mean, 0.03 * 0.25);
  EXPECT_LT(worst, 0.5 * 0.25);
  EXPECT_NEAR(filled_volume(mesh), enclosed_volume(sphere), 0.05 * enclosed_volume(sphere));
}

// The tets' faces are chords of about 0.25 m, or tangents; outwards by the sagitta h^2 / (8 r) = 0.008 m they hold all.
TEST(PushedAroundVertices, EnclosesAllAndStaysNearTheSurface) {
  const sim::SurfaceMesh sphere = icosphere(1, 4);
  const auto enclosed = enclosing_mesh(sphere, {.cell_size = 0.25});
  const sim::TetMesh fitted = fitted_to_surface(*enclosed, sphere);
  EXPECT_GT(outside_vertices(fitted, sphere.vertices).size(), sphere.vertices.size() / 3);
  const sim::TetMesh mesh = pushed_around_vertices(fitted, sphere, 0.25);
  EXPECT_TRUE(sim::validate(mesh, "mesh"));
  EXPECT_EQ(outside_vertices(mesh, sphere.vertices).size(), 0u);
  double mean = 0;
  const auto boundary = surface_nodes(mesh.tets);
  for (const int node : boundary) mean += (mesh.X[node].norm() - 1) / static_cast<double>(boundary.size());
  EXPECT_LT(mean, 0.12 * 0.25);  // where tets are flat, more of them move
  EXPECT_NEAR(filled_volume(mesh), enclosed_volume(sphere), 0.05 * enclosed_volume(sphere));
}

TEST(FittedToSurface, KeepsTheCornersOfABox) {
  const sim::SurfaceMesh box = box_surface({1, 0.6, 0.4});
  const sim::TetMesh mesh = fitted_to_surface(*enclosing_mesh(box, {.cell_size = 0.25}), box);
  for (const Vec3& corner : box.vertices) {
    double nearest = 1e9;
    for (const Vec3& p : mesh.X) nearest = std::min(nearest, (p - corner).norm());
    EXPECT_LT(nearest, 0.05) << corner.transpose();
  }
}

// ---- poses
// ------------------------------------------------------------------------------------------------------------------
TEST(FitExample, ReproducesATranslationExactly) {
  auto rig = make_rig(icosphere(1, 3), {.cell_size = 0.4}, 10);
  ASSERT_TRUE(rig) << rig.error().text();
  const Vec3 shift(0.3, -0.2, 0.1);
  add_example(*rig, "shifted", [&](const Vec3&) { return shift; });
  const auto x = posed(rig->set, 1);
  for (int i = 0; i < rig->set.vertex_count(); ++i) EXPECT_NEAR((x[i] - rig->set.mesh.X[i] - shift).norm(), 0, 1e-12);
}

TEST(FitExample, ReproducesARotationWhereBonesMayTurn) {
  auto rig = make_rig(icosphere(1, 3), {.cell_size = 0.4}, 10);
  ASSERT_TRUE(rig);
  const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const PoseField turn = [&](const Vec3& X) -> Vec3 { return R * X - X; };
  add_example(*rig, "turned", turn, BoneRotations::follow_field);
  add_example(*rig, "slid", turn);
  const auto turned = posed(rig->set, 1), slid = posed(rig->set, 2);
  double worst_turned = 0, worst_slid = 0;
  for (int i = 0; i < rig->set.vertex_count(); ++i) {
    worst_turned = std::max(worst_turned, (turned[i] - R * rig->set.mesh.X[i]).norm());
    worst_slid = std::max(worst_slid, (slid[i] - R * rig->set.mesh.X[i]).norm());
  }
  EXPECT_LT(worst_turned, 1e-9);
  EXPECT_GT(worst_slid, 0.02);  // translations alone cannot turn
}

TEST(PoseField, FlattenMovesWhatLiesBeforeThePlaneOntoIt) {
  const PoseField field =
      dent({.profile = Dent::Profile::flatten, .direction = -Vec3::UnitX(), .face = -1, .depth = 0.4});
  EXPECT_NEAR((Vec3(1, 0, 0) + field({1, 0, 0})).x(), 0.6, 1e-3);
  EXPECT_NEAR((Vec3(0.8, 0.3, 0) + field({0.8, 0.3, 0})).x(), 0.6, 1e-3);
  EXPECT_NEAR(field({0.2, 0, 0}).norm(), 0, 1e-4);
}

TEST(PoseField, CrushShortensItsZoneAndLeavesTheRest) {
  const PoseField field = dent({.direction = Vec3::UnitZ(), .face = -1, .depth = 0.5, .zone = 1});
  EXPECT_NEAR(field({0, 0, -1}).z(), 0.5, 1e-12);
  EXPECT_EQ(field({0, 0, 0.1}).norm(), 0);
  double before = -1e9;
  for (double z = -1; z < 1; z += 0.01) {  // no fold: order along the push is kept
    const double after = z + field({0, 0, z}).z();
    EXPECT_GT(after, before);
    before = after;
  }
}

TEST(PoseField, KinkTurnsTheEndsTowardsEachOther) {
  const PoseField field = kink({.angle = 0.8, .width = 0.05});
  const Vec3 top = Vec3(0, 1, 0) + field({0, 1, 0}), bottom = Vec3(0, -1, 0) + field({0, -1, 0});
  EXPECT_NEAR(std::acos(top.normalized().dot(-bottom.normalized())), 0.8, 1e-6);
  EXPECT_NEAR(top.norm(), 1, 1e-9);
}

// ---- assets
// -------------------------------------------------------------------------------------------------------------------
TEST(BarrelAsset, IsValidAndDents) {
  const auto barrel = make_barrel_asset();
  ASSERT_TRUE(barrel) << barrel.error().text();
  EXPECT_TRUE(sim::example_based::validate(*barrel, "barrel"));
  EXPECT_THAT(names(*barrel), ElementsAre("rest", "crushed_side", "squashed", "bent", "crumpled"));
  EXPECT_EQ(barrel->bone_count(), 18);
  EXPECT_GE(barrel->vertex_count(), 500);
  EXPECT_LE(barrel->vertex_count(), 1800);
  EXPECT_EQ(barrel->convex_parts.size(), 1u);
  EXPECT_NEAR(filled_volume(barrel->mesh), enclosed_volume(barrel->render), 0.06 * enclosed_volume(barrel->render));

  const Eigen::AlignedBox3d rest = box_of(posed(*barrel, 0));
  EXPECT_NEAR((rest.sizes() - box_of(barrel->render.vertices).sizes()).norm(), 0, 0.02);
  EXPECT_LT(box_of(posed(*barrel, 1)).max().x(), 0.75 * rest.max().x());
  EXPECT_LT(box_of(posed(*barrel, 2)).sizes().y(), 0.75 * rest.sizes().y());
  EXPECT_GT(box_of(posed(*barrel, 3)).sizes().x(), 1.1 * rest.sizes().x());
  for (int e = 1; e < barrel->example_count(); ++e) EXPECT_LT(inverted_share(*barrel, e), 0.02) << names(*barrel)[e];
}

TEST(CarAsset, IsValidAndEachSideGivesWay) {
  const auto car = make_car_asset();
  ASSERT_TRUE(car) << car.error().text();
  EXPECT_TRUE(sim::example_based::validate(*car, "car"));
  EXPECT_THAT(names(*car),
              ElementsAre("rest", "crushed_front", "crushed_rear", "dented_left", "dented_right", "roof_flattened"));
  EXPECT_EQ(car->bone_count(), 32);
  EXPECT_GE(car->vertex_count(), 1000);
  EXPECT_LE(car->vertex_count(), 2500);
  EXPECT_EQ(car->convex_parts.size(), 8u);  // three of the body, the cabin, four wheels

  const Eigen::AlignedBox3d rest = box_of(posed(*car, 0));
  EXPECT_NEAR((rest.min() - box_of(car->render.vertices).min()).norm(), 0, 0.1);
  EXPECT_NEAR(rest.min().y(), 0, 0.01);  // it collides where its wheels are drawn
  EXPECT_LT(box_of(posed(*car, 1)).max().x(), rest.max().x() - 0.4);
  EXPECT_GT(box_of(posed(*car, 2)).min().x(), rest.min().x() + 0.35);
  EXPECT_LT(box_of(posed(*car, 5)).max().y(), rest.max().y() - 0.25);
  for (const auto& [e, side] : {std::pair(3, -1.0), {4, 1.0}}) {
    double deepest = 0;
    const auto x = posed(*car, e);
    for (int i = 0; i < car->vertex_count(); ++i)
      if (side * car->mesh.X[i].z() > 0.7) deepest = std::max(deepest, side * (car->mesh.X[i].z() - x[i].z()));
    EXPECT_GT(deepest, 0.3);
  }
  for (int e = 1; e < car->example_count(); ++e) EXPECT_LT(inverted_share(*car, e), 0.02) << names(*car)[e];
}

TEST(DefaultAsset, DentsAnySurfaceFromSixSides) {
  const auto asset = make_default_asset(icosphere(1, 3), {.enclosing = {.cell_size = 0.25}});
  ASSERT_TRUE(asset) << asset.error().text();
  EXPECT_EQ(asset->example_count(), 7);
  EXPECT_EQ(asset->convex_parts.size(), 1u);
  const Eigen::AlignedBox3d rest = box_of(posed(*asset, 0));
  for (int side = 0; side < 6; ++side) {
    const Eigen::AlignedBox3d box = box_of(posed(*asset, side + 1));
    const int axis = side / 2;
    const double moved = side % 2 == 1 ? rest.max()[axis] - box.max()[axis] : box.min()[axis] - rest.min()[axis];
    EXPECT_GT(moved, 0.25) << asset->examples[side + 1].name;
  }
}

TEST(DefaultAsset, HasBoundedBiharmonicWeightsWhereAskedFor) {
  DefaultAssetOptions options{.enclosing = {.cell_size = 0.25}, .weights = RigWeights::bounded_biharmonic};
  const auto asset = make_default_asset(icosphere(1, 3), options);
  ASSERT_TRUE(asset) << asset.error().text();
  // Every bone stands at a vertex that it holds alone, where Gaussians share everywhere.
  for (int b = 0; b < asset->bone_count(); ++b) EXPECT_EQ(asset->W.col(b).maxCoeff(), 1);
  const Eigen::AlignedBox3d rest = box_of(posed(*asset, 0));
  for (int side = 0; side < 6; ++side) EXPECT_LT(box_of(posed(*asset, side + 1)).volume(), 0.95 * rest.volume());
  options.weights = RigWeights::gaussian;
  EXPECT_LT(make_default_asset(icosphere(1, 3), options)->W.maxCoeff(), 1);
}

TEST(DefaultAsset, CutsALongBodyIntoConvexPartsThatCoverIt) {
  const auto asset = make_default_asset(box_surface({2, 0.5, 0.5}), {.enclosing = {.cell_size = 0.25}, .bones = 8});
  ASSERT_TRUE(asset) << asset.error().text();
  EXPECT_EQ(asset->convex_parts.size(), 4u);
  std::vector<char> covered(asset->vertex_count(), false);
  for (const auto& part : asset->convex_parts)
    for (const int id : part) covered[id] = true;
  for (const int id : nodes_at_solid(asset->mesh, asset->render, 0.025)) EXPECT_TRUE(covered[id]);
}

TEST(DefaultAsset, BadInputIsAnError) {
  const auto text = [](const Result<ExampleSet>& r) { return r ? std::string("no error") : r.error().text(); };
  EXPECT_THAT(text(make_default_asset({})), HasSubstr("surface.vertices is empty"));
  EXPECT_THAT(text(make_default_asset(icosphere(1, 1), {.bones = 0})), HasSubstr("bones is 0"));
  EXPECT_THAT(text(make_default_asset(icosphere(1, 1), {.depth = 2})), HasSubstr("depth is 2"));
}

}  // namespace
}  // namespace crumple::authoring
