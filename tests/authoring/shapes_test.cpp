#include "server/authoring/shapes/barrel.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/authoring/shapes/car.h"
#include "server/authoring/shapes/node_sets.h"
#include "server/authoring/shapes/surfaces.h"
#include "server/authoring/tet_connectivity.h"
#include "tests/authoring/surfaces_for_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace crumple::authoring {
namespace {

using ::testing::HasSubstr;

double volume(const sim::TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += sim::signed_volume(mesh, t);
  return sum;
}

// ---- tet lattices
// -----------------------------------------------------------------------------------------------------
class BoxLatticeTest : public testing::TestWithParam<Lattice> {};

TEST_P(BoxLatticeTest, FillsTheBoxConformingly) {
  const BoxLattice box{.size = {2, 0.4, 0.6}, .cells = {5, 2, 3}, .lattice = GetParam(), .minimum = {-1, 2, 3}};
  const auto mesh = box_mesh(box);
  ASSERT_TRUE(mesh) << mesh.error().text();
  EXPECT_TRUE(sim::validate(*mesh, "mesh"));
  EXPECT_NEAR(volume(*mesh), 2 * 0.4 * 0.6, 1e-12);
  const auto neighbours = face_neighbours(mesh->tets);
  EXPECT_EQ(face_parts(neighbours).count, 1);
  EXPECT_TRUE(pinched_nodes(mesh->tets, neighbours, mesh->node_count()).empty());
  // A face without a neighbour lies in the box's own faces.
  Eigen::AlignedBox3d bounds;
  for (const Vec3& p : mesh->X) bounds.extend(p);
  EXPECT_NEAR((bounds.min() - box.minimum).norm() + (bounds.max() - box.minimum - box.size).norm(), 0, 1e-14);
  for (const sim::SurfaceFace& face : sim::surface_faces(mesh->tets)) {
    bool flat = false;
    for (int d = 0; d < 3; ++d)
      for (const double plane : {bounds.min()[d], bounds.max()[d]})
        flat = flat || std::all_of(face.nodes.begin(), face.nodes.end(),
                                   [&](int n) { return std::abs(mesh->X[n][d] - plane) < 1e-12; });
    EXPECT_TRUE(flat);
  }
}

INSTANTIATE_TEST_SUITE_P(All, BoxLatticeTest, testing::Values(Lattice::femfx, Lattice::kuhn, Lattice::bcc));

TEST(BoxMesh, CountsAreThoseOfTheBenchmarks) {
  EXPECT_EQ(beam({2, .4, .4}, {25, 4, 4}, Lattice::femfx)->tet_count(), 2400);
  EXPECT_EQ(beam({1, .16, .16}, {25, 4, 4}, Lattice::kuhn)->tet_count(), 2400);
  EXPECT_EQ(beam({2, .4, .4}, {40, 10, 10}, Lattice::femfx)->tet_count(), 24000);
  EXPECT_EQ(beam({2, .4, .4}, {64, 16, 16}, Lattice::femfx)->tet_count(), 98304);
  EXPECT_EQ(centred_box_mesh({1, 1, 1}, {2, 2, 2}, Lattice::femfx)->tet_count(), 48);
  EXPECT_EQ(pane(2, 2, .05, {20, 20, 1}, Lattice::femfx)->tet_count(), 2400);
  // The locking study's BCC beams: 4800 tets and 3075 free unknowns, 576 and 468.
  for (const auto& [cells, tets, unknowns] :
       {std::tuple(std::array{25, 4, 4}, 4800, 3075), {std::array{12, 2, 2}, 576, 468}}) {
    const auto bcc = beam({1, .16, .16}, cells, Lattice::bcc);
    EXPECT_EQ(bcc->tet_count(), tets);
    EXPECT_EQ(3 * (bcc->node_count() - static_cast<int>(nodes_on_side(bcc->X, Side::min_x).size())), unknowns);
  }
}

// The six tets of the first cell, read off ANCHORS' list with v0 = (0,0,0) ... and k towards -z.
TEST(BoxMesh, FemfxCellIsTheListedOne) {
  const auto mesh = beam({1, 1, 1}, {1, 1, 1}, Lattice::femfx);
  ASSERT_TRUE(mesh);
  const Vec3 v[] = {{0, 0, 0}, {1, 0, 0}, {1, 0, -1}, {0, 0, -1}, {0, 1, 0}, {1, 1, 0}, {1, 1, -1}, {0, 1, -1}};
  const int listed[6][4] = {{0, 1, 3, 4}, {1, 3, 4, 5}, {3, 5, 7, 4}, {1, 2, 3, 5}, {3, 2, 7, 5}, {2, 7, 5, 6}};
  for (int t = 0; t < 6; ++t)
    for (const int corner : listed[t])
      EXPECT_TRUE(std::any_of(mesh->tets[t].begin(), mesh->tets[t].end(),
                              [&](int n) { return (mesh->X[n] - v[corner]).norm() < 1e-15; }));
}

TEST(BoxMesh, EveryKuhnTetHoldsTheDiagonal) {
  const auto mesh = box_mesh({.size = {1, 1, 1}, .lattice = Lattice::kuhn, .minimum = Vec3::Zero()});
  ASSERT_TRUE(mesh);
  for (const Tet& t : mesh->tets)
    for (const Vec3& end : {Vec3(0, 0, 0), Vec3(1, 1, 1)})
      EXPECT_TRUE(std::any_of(t.begin(), t.end(), [&](int n) { return mesh->X[n] == end; }));
}

TEST(BoxMesh, BadInputIsAnError) {
  const auto text = [](const Result<sim::TetMesh>& r) { return r ? std::string("no error") : r.error().text(); };
  EXPECT_THAT(text(box_mesh({.size = {1, 0, 1}})), HasSubstr("size is 0 m"));
  EXPECT_THAT(text(box_mesh({.size = {1, NAN, 1}})), HasSubstr("size is nan m"));
  EXPECT_THAT(text(box_mesh({.cells = {1, 0, 1}})), HasSubstr("cells is 0"));
  EXPECT_THAT(text(box_mesh({.cells = {1000, 1000, 1000}})), HasSubstr("cells give 6e+09 tets"));
}

TEST(NodeSets, SelectSidesAndBoxes) {
  const auto mesh = pane(2, 1, 0.1, {4, 2, 1}, Lattice::kuhn);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(nodes_on_side(mesh->X, Side::min_x).size(), 6u);
  EXPECT_EQ(nodes_on_side(mesh->X, Side::max_z).size(), 15u);
  constexpr Side kRim[] = {Side::min_x, Side::max_x, Side::min_y, Side::max_y};
  EXPECT_EQ(nodes_on_sides(mesh->X, kRim).size(), 2 * (15u - 3u));
  EXPECT_EQ(nodes_in_box(mesh->X, {-0.1, -1, -1}, {0.1, 1, 1}).size(), 6u);
  EXPECT_TRUE(nodes_on_side({}, Side::min_x).empty());
}

// ---- surfaces
// ----------------------------------------------------------------------------------------------------------
void expect_closed_and_outward(const sim::SurfaceMesh& surface, const char* what) {
  const test::EdgeCount edges = test::count_edges(surface);
  EXPECT_TRUE(sim::validate(surface, what));
  EXPECT_TRUE(edges.closed) << what;
  EXPECT_TRUE(edges.oriented) << what;
  EXPECT_GT(enclosed_volume(surface), 0) << what;
}

TEST(Surfaces, AreClosedOutwardSpheres) {
  const std::pair<const char*, sim::SurfaceMesh> all[] = {{"box", box_surface({1, 2, 3})},
                                                          {"icosphere", icosphere(1, 3)},
                                                          {"cylinder", cylinder_surface(1, 2, 16)},
                                                          {"barrel", barrel_surface()},
                                                          {"plain barrel", barrel_surface(plain_barrel())},
                                                          {"wheel", car_surface().wheels[0]}};
  for (const auto& [name, surface] : all) {
    expect_closed_and_outward(surface, name);
    EXPECT_EQ(test::euler_characteristic(surface), 2) << name;
  }
}

TEST(Surfaces, HaveTheirVolumes) {
  EXPECT_NEAR(enclosed_volume(box_surface({1, 2, 3})), 48, 1e-12);
  EXPECT_NEAR(enclosed_volume(icosphere(1, 5)), 4 * std::numbers::pi / 3, 5e-3);
  EXPECT_NEAR(enclosed_volume(cylinder_surface(1, 2, 64)), 4 * 64 / 2.0 * std::sin(2 * std::numbers::pi / 64), 1e-9);
}

TEST(Barrel, PlainOneIsTheBenchmarksBarrel) {
  const sim::SurfaceMesh barrel = barrel_surface(plain_barrel());
  EXPECT_EQ(barrel.triangles.size(), 288u);
  for (const Vec3& v : barrel.vertices) {
    const double r = std::hypot(v.x(), v.z());
    if (r > 0) {
      EXPECT_NEAR(r, 0.3 * (1 - 0.25 * std::pow(2 * v.y() / 0.9, 2)), 1e-12);
    }
  }
}

TEST(Barrel, DefaultIs66By90Centimetres) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : barrel_surface().vertices) box.extend(v);
  EXPECT_NEAR(box.sizes().x(), 0.66, 0.02);
  EXPECT_NEAR(box.sizes().y(), 0.9, 1e-12);
}

TEST(Car, IsClosedOutwardPartsOfItsSize) {
  const CarSurface car = car_surface();
  expect_closed_and_outward(car.whole(), "car");
  Eigen::AlignedBox3d box;
  for (const Vec3& v : car.whole().vertices) box.extend(v);
  EXPECT_NEAR(box.sizes().x(), 4.2, 0.05);
  EXPECT_NEAR(box.sizes().y(), 1.4, 0.05);
  EXPECT_NEAR(box.sizes().z(), 1.7, 0.05);
  EXPECT_NEAR(box.min().y(), 0, 1e-9);  // it stands on the ground
  // Body, two bumpers, four lamps, four wheels: each a closed surface without handles.
  EXPECT_EQ(test::euler_characteristic(car.whole()), 2 * 11);
  for (const sim::SurfaceMesh& wheel : car.wheels) EXPECT_GT(enclosed_volume(wheel), 0);
}

TEST(Car, ScalesWithItsShape) {
  const CarSurface car = car_surface({.length = 2.1, .width = 1.7, .height = 0.7});
  EXPECT_NEAR(enclosed_volume(car.whole()), enclosed_volume(car_surface().whole()) / 4, 1e-9);
  EXPECT_NEAR(car.wheel_radius, 0.16, 1e-12);
}

}  // namespace
}  // namespace crumple::authoring
