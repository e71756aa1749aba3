#include "server/sim/example_based/geodesic_distance.h"

#include "tests/sim/example_based/bar_fixture.h"

#include <limits>

namespace crumple::sim::example_based {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

TEST(GeodesicDistance, AgreesWithFloydWarshall) {
  std::mt19937 random(4);
  TetMesh mesh = bar_mesh({2, 2, 3}, 0.3);
  for (Vec3& X : mesh.X) X += 0.05 * random_vector(random);
  const EdgeGraph graph = edge_graph(mesh.X, mesh.tets);
  const int n = mesh.node_count();
  Eigen::MatrixXd d = Eigen::MatrixXd::Constant(n, n, kUnbounded);
  for (int i = 0; i < n; ++i) d(i, i) = 0;
  for (const Tet& tet : mesh.tets)
    for (int a : tet)
      for (int b : tet) d(a, b) = (mesh.X[a] - mesh.X[b]).norm();
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) d(i, j) = std::min(d(i, j), d(i, k) + d(k, j));

  GeodesicSearch search;
  for (int source = 0; source < n; ++source) {
    const auto all = search.run(graph, source, kUnbounded);
    ASSERT_EQ(static_cast<int>(all.size()), n);
    for (int i = 0; i < n; ++i) {
      EXPECT_EQ(all[i].vertex, i);
      EXPECT_NEAR(all[i].distance, d(source, i), 1e-12);
    }
    // Bounded: the same distances, and no vertex at or beyond the bound.
    std::size_t inside = 0;
    for (int i = 0; i < n; ++i) inside += d(source, i) < 0.7;
    const auto near = search.run(graph, source, 0.7);
    EXPECT_EQ(near.size(), inside);
    for (const Reached& r : near) EXPECT_NEAR(r.distance, d(source, r.vertex), 1e-12);
  }
}

TEST(GeodesicDistance, IsExactAlongTheEdgesOfALattice) {
  const TetMesh mesh = test::kuhn_lattice({4, 4, 4}, 0.5);
  GeodesicSearch search;
  const auto all = search.run(edge_graph(mesh.X, mesh.tets), 0, kUnbounded);
  EXPECT_NEAR(all[4].distance, 2, 1e-12);                       // along x
  EXPECT_NEAR(all.back().distance, 2 * std::sqrt(3.0), 1e-12);  // along the cubes' diagonals
}

TEST(GeodesicDistance, DoesNotReachAnotherComponent) {
  TetMesh mesh = test::kuhn_lattice({1, 1, 1}, 1);
  const int n = mesh.node_count();
  TetMesh two = mesh;
  for (const Vec3& X : mesh.X) two.X.push_back(X + Vec3(1.001, 0, 0));
  for (Tet tet : mesh.tets) {
    for (int& i : tet) i += n;
    two.tets.push_back(tet);
  }
  GeodesicSearch search;
  const auto all = search.run(edge_graph(two.X, two.tets), 0, kUnbounded);
  EXPECT_EQ(static_cast<int>(all.size()), n);
  EXPECT_LT(all.back().vertex, n);
}

}  // namespace
}  // namespace crumple::sim::example_based
