#include "server/sim/mesh/node_stars.h"

#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace crumple::sim {
namespace {

TEST(NodeStars, ASplitLeavesThemAsIfBuiltAnew) {
  TetMesh mesh = test::kuhn_lattice({3, 3, 3}, 1);
  NodeStars stars(mesh.tets, mesh.node_count());
  for (const int node : {21, 5, 21, 0}) {
    const int copy = stars.split(node, [](int t) { return t % 3 == 0; });
    EXPECT_EQ(copy, mesh.node_count());
    for (const int t : stars[copy]) std::replace(mesh.tets[t].begin(), mesh.tets[t].end(), node, copy);
    mesh.X.push_back(mesh.X[node]);
    const NodeStars anew(mesh.tets, mesh.node_count());
    for (int n = 0; n < mesh.node_count(); ++n) EXPECT_TRUE(std::ranges::equal(stars[n], anew[n])) << n;
  }
}

}  // namespace
}  // namespace crumple::sim
