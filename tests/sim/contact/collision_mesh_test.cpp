#include "server/sim/contact/collision_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <set>

#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::contact {
namespace {

TEST(CollisionMesh, MarksTheFacesOfTheSurface) {
  const TetMesh cube = test::kuhn_lattice({3, 3, 3}, 1);
  const CollisionMesh mesh = make_collision_mesh(cube.tets, cube.X, std::vector<double>(cube.tets.size(), 2.0));
  ASSERT_EQ(mesh.components.size(), 1u);
  const CollisionComponent& part = mesh.components[0];
  EXPECT_EQ(part.end - part.begin, cube.tet_count());
  EXPECT_NEAR(part.volume, 27, 1e-12);
  EXPECT_NEAR(part.mass, 2.0 * cube.tet_count(), 1e-12);
  int faces = 0;
  for (int k = 0; k < part.end; ++k) {
    faces += std::popcount(mesh.tets[k].exterior);
    EXPECT_EQ(mesh.tets[k].exterior != 0, k < part.boundary_end);
    EXPECT_EQ(mesh.tets[k].nodes, cube.tets[mesh.tets[k].id]);
  }
  EXPECT_EQ(faces, 6 * 9 * 2);
  EXPECT_LT(part.boundary_end, part.end) << "the lattice has interior tets";
}

TEST(CollisionMesh, PartsThatShareOnlyAnEdgeAreComponents) {
  // Two cubes of a 2x2x1 lattice that meet along the edge x = y = 1.
  const TetMesh lattice = test::kuhn_lattice({2, 2, 1}, 1);
  std::vector<Tet> tets(lattice.tets.begin(), lattice.tets.begin() + 6);
  tets.insert(tets.end(), lattice.tets.begin() + 18, lattice.tets.end());
  const CollisionMesh mesh = make_collision_mesh(tets, lattice.X, {});
  ASSERT_EQ(mesh.components.size(), 2u);
  EXPECT_EQ(mesh.components[0].end, 6);
  // Each has all of its nodes once, those of the edge too.
  for (const CollisionComponent& part : mesh.components) {
    std::set<int> expected;
    for (int k = part.begin; k < part.end; ++k) expected.insert(mesh.tets[k].nodes.begin(), mesh.tets[k].nodes.end());
    const std::span<const int> listed = mesh.nodes_of(part);
    const std::multiset<int> nodes(listed.begin(), listed.end());
    EXPECT_TRUE(std::ranges::equal(nodes, expected));
    EXPECT_EQ(nodes.size(), 8u);
  }
  EXPECT_EQ(mesh.components[1].begin, 6);
  EXPECT_EQ(mesh.components[1].end, 12);
  EXPECT_NEAR(mesh.components[1].volume, 1, 1e-14);
  int faces = 0;
  for (const CollisionTet& tet : mesh.tets) faces += std::popcount(tet.exterior);
  EXPECT_EQ(faces, 24);
}

// Every other cell of a row, their tets in turn: each is a component.
TetMesh cells_apart() {
  const TetMesh row = test::kuhn_lattice({7, 2, 2}, 1);
  TetMesh mesh{row.X, {}};
  for (int k = 0; k < row.tet_count(); ++k) {
    const int t = (k * 59) % row.tet_count();
    double x = 0;
    for (const int n : row.tets[t]) x += row.X[n].x() / 4;
    if (static_cast<int>(x) % 2 == 0) mesh.tets.push_back(row.tets[t]);
  }
  return mesh;
}

TEST(CollisionMesh, OfWhatStaysIsThatOfTheTetsThatStay) {
  const TetMesh all = cells_apart();
  std::vector<double> mass(all.tets.size());
  for (std::size_t t = 0; t < mass.size(); ++t) mass[t] = 1 + 0.01 * static_cast<double>(t);
  const CollisionMesh mesh = make_collision_mesh(all.tets, all.X, mass);
  ASSERT_EQ(mesh.components.size(), 4u);
  for (const std::set<std::size_t>& left : {std::set<std::size_t>{}, {0}, {2}, {1, 3}, {0, 1, 2, 3}}) {
    std::vector<int> new_tet(all.tets.size(), 0), new_node(all.X.size(), 0);
    for (const std::size_t c : left) {
      for (int k = mesh.components[c].begin; k < mesh.components[c].end; ++k) new_tet[mesh.tets[k].id] = -1;
      for (const int n : mesh.nodes_of(mesh.components[c])) new_node[n] = -1;
    }
    TetMesh rest;
    std::vector<double> rest_mass;
    for (std::size_t n = 0; n < all.X.size(); ++n) {
      if (new_node[n] < 0) continue;
      new_node[n] = rest.node_count();
      rest.X.push_back(all.X[n]);
    }
    for (std::size_t t = 0; t < all.tets.size(); ++t) {
      if (new_tet[t] < 0) continue;
      new_tet[t] = rest.tet_count();
      Tet tet = all.tets[t];
      for (int& n : tet) n = new_node[n];
      rest.tets.push_back(tet);
      rest_mass.push_back(mass[t]);
    }
    std::vector<int> kept;
    for (std::size_t c = 0; c < mesh.components.size(); ++c)
      if (!left.contains(c)) kept.push_back(static_cast<int>(c));
    EXPECT_EQ(kept_components(mesh, kept, new_tet, new_node), make_collision_mesh(rest.tets, rest.X, rest_mass)) << left.size();
  }
}

TEST(CollisionMesh, HasTheSurfaceOfItsTets) {
  const TetMesh all = cells_apart();
  std::vector<Triangle> surface, expected;
  append_surface(make_collision_mesh(all.tets, all.X, {}), surface);
  for (const SurfaceFace& face : surface_faces(all.tets)) expected.push_back(face.nodes);
  EXPECT_EQ(surface, expected);
}

}  // namespace
}  // namespace crumple::sim::contact
