#include "server/sim/contact/submerged_nodes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::contact {
namespace {

// A unit cube of 48 tets.
struct Cube {
  TetMesh mesh = test::kuhn_lattice({2, 2, 2}, 0.5);
  CollisionMesh collision = make_collision_mesh(mesh.tets, mesh.X, {});
};

TEST(SubmergedNodes, AFlatFacesAreaIsSharedByItsNodes) {
  const Cube cube;
  const auto nodes = submerged_nodes(cube.collision.tets, cube.mesh.X, Vec3::UnitY(), 0.01);
  ASSERT_EQ(nodes.size(), 9u);
  double area = 0;
  for (const SubmergedNode& n : nodes) {
    EXPECT_EQ(cube.mesh.X[n.node].y(), 0);
    EXPECT_DOUBLE_EQ(n.depth, 0.01);
    area += n.area;
  }
  EXPECT_NEAR(area, 1, 1e-14);
  for (std::size_t k = 1; k < nodes.size(); ++k) EXPECT_LT(nodes[k - 1].node, nodes[k].node);
}

TEST(SubmergedNodes, ACornerHasTheAreaOfItsFacesAlongTheNormal) {
  const Cube cube;
  const Vec3 normal = Vec3::Ones().normalized();
  const auto nodes = submerged_nodes(cube.collision.tets, cube.mesh.X, normal, 0.1);
  ASSERT_EQ(nodes.size(), 1u);  // the corner at the origin
  EXPECT_DOUBLE_EQ(nodes[0].depth, 0.1);
  // Six triangles of 1/8 m^2, two a face, a third of each, seen at cos = 1/sqrt(3).
  EXPECT_NEAR(nodes[0].area, 6.0 / 8 / 3 / std::sqrt(3), 1e-14);
}

TEST(SubmergedNodes, WhatHasSunkKeepsAnAreaEverywhere) {
  const Cube cube;
  const auto nodes = submerged_nodes(cube.collision.tets, cube.mesh.X, Vec3::UnitY(), 3);
  ASSERT_EQ(nodes.size(), 27u);
  for (const SubmergedNode& n : nodes) {
    EXPECT_GT(n.area, 0);
    if (cube.mesh.X[n.node] == Vec3::Constant(0.5)) {
      EXPECT_NEAR(n.area, std::cbrt(1.0 / 64), 1e-14);  // 24 tets of 1/48 m^3, a quarter of each: (1/8)^(2/3)
    }
  }
}

TEST(SubmergedNodes, NodesThatAreNotFiniteAreNotBelow) {
  Cube cube;
  for (Vec3& x : cube.mesh.X) x.y() = std::nan("");
  EXPECT_TRUE(submerged_nodes(cube.collision.tets, cube.mesh.X, Vec3::UnitY(), 0).empty());
}

}  // namespace
}  // namespace crumple::sim::contact
