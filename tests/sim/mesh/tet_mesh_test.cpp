#include "server/sim/mesh/tet_mesh.h"

#include "server/sim/mesh/tet_faces.h"
#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

#include <limits>

namespace crumple::sim {
namespace {

TetMesh unit_tet() { return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, {{0, 1, 2, 3}}, {}}; }

TEST(TetMesh, VolumeOfUnitTetIsASixth) {
  TetMesh mesh = unit_tet();
  EXPECT_DOUBLE_EQ(signed_volume(mesh, 0), 1.0 / 6);
  std::swap(mesh.tets[0][0], mesh.tets[0][1]);
  EXPECT_DOUBLE_EQ(signed_volume(mesh, 0), -1.0 / 6);
}

TEST(TetMesh, SurfaceOfALatticeIsTheBoxAndFacesOutward) {
  const TetMesh mesh = test::kuhn_lattice({3, 4, 5}, 0.5);
  const auto faces = surface_faces(mesh.tets);
  EXPECT_EQ(faces.size(), 2u * 2 * (3 * 4 + 4 * 5 + 3 * 5));  // two triangles a square
  double area = 0, volume = 0;
  int last_tet = 0;
  for (const SurfaceFace& face : faces) {
    const Vec3 &a = mesh.X[face.nodes[0]], &b = mesh.X[face.nodes[1]], &c = mesh.X[face.nodes[2]];
    const Vec3 n = (b - a).cross(c - a) / 2;
    area += n.norm();
    volume += n.dot(a) / 3;  // divergence theorem: only right if every face looks outward
    EXPECT_LT(n.dot(mesh.X[mesh.tets[face.tet][face.opposite]] - a), 0);
    EXPECT_GE(face.tet, last_tet);
    last_tet = face.tet;
  }
  EXPECT_NEAR(area, 2 * (1.5 * 2 + 2 * 2.5 + 1.5 * 2.5), 1e-12);
  EXPECT_NEAR(volume, 1.5 * 2 * 2.5, 1e-12);
}

TEST(TetMesh, SortedFacesPutNeighboursSideBySide) {
  const TetMesh mesh = test::kuhn_lattice({3, 3, 3}, 1);
  const auto faces = sorted_faces(mesh.tets);
  ASSERT_EQ(faces.size(), 4 * mesh.tets.size());
  int shared = 0;
  for (std::size_t i = 1; i < faces.size(); ++i) {
    EXPECT_LE(faces[i - 1].key, faces[i].key);
    shared += faces[i].same_face(faces[i - 1]);
  }
  EXPECT_EQ(shared, (4 * mesh.tet_count() - static_cast<int>(surface_faces(mesh.tets).size())) / 2);
}

TEST(TetMesh, ValidateAcceptsALattice) { EXPECT_TRUE(validate(test::kuhn_lattice({2, 2, 2}, 1e-3), "mesh")); }

TEST(TetMesh, ValidateNamesTheFirstBreach) {
  const auto error = [](auto&& spoil) {
    TetMesh mesh = unit_tet();
    spoil(mesh);
    const auto result = validate(mesh, "bodies[2].fem.mesh");
    return result ? std::string("accepted") : result.error().text();
  };
  const auto has = [](const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(has(error([](TetMesh& m) { m.tets.clear(); }), "bodies[2].fem.mesh.tets is empty"));
  EXPECT_TRUE(has(error([&](TetMesh& m) { m.X[1][2] = nan; }), ".X[1] is not finite"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.tets[0][3] = 4; }), ".tets[0] names node 4"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.tets[0][3] = -1; }), ".tets[0] names node -1"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.tets[0][3] = 1; }), ".tets[0] names node 1 twice"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.X[3][2] = 0; }), ".tets[0] has volume 0"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.X[3][2] = -1; }), ".tets[0] has volume -0.166667"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.X[3][2] = 1e-12; }), ".tets[0] has volume"));  // sliver
  EXPECT_TRUE(has(error([](TetMesh& m) { m.X[3][2] = 1e300; }), ".tets[0] has volume"));  // cube overflows
  EXPECT_TRUE(has(error([](TetMesh& m) { m.fill = {1, 1}; }), ".fill holds 2 values"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.fill = {0}; }), ".fill[0] is 0"));
  EXPECT_TRUE(has(error([&](TetMesh& m) { m.fill = {nan}; }), ".fill[0] is nan"));
  EXPECT_TRUE(has(error([](TetMesh& m) { m.tets.resize(kMaxTets + 1, m.tets[0]); }), "must hold at most 2000000"));
}

}  // namespace
}  // namespace crumple::sim
