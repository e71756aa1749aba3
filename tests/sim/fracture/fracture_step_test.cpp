#include "server/sim/fracture/fracture_step.h"

#include "server/sim/fracture/fragments.h"
#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

namespace crumple::sim::fracture {
namespace {

// A bar stretched along x by `strain` and turned. Without Poisson's effect its stress is E strain everywhere.
struct Bar {
  Bar(double strain, int threads, double fill = 1) : mesh(test::kuhn_lattice({8, 3, 3}, 0.1)), pool(threads) {
    if (fill < 1) mesh.fill.assign(mesh.tets.size(), fill);
    fem::FemMaterial material;
    material.young = 1e7;
    material.poisson = 0;
    material.breakable = true;
    material.toughness = 1e5;
    rest = *fem::make_rest_body(mesh, material);
    const Mat3 R = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    axis = R.col(0);
    for (const Vec3& X : mesh.X) {
      state.x.push_back(R * Vec3((1 + strain) * X.x(), X.y(), X.z()));
      state.v.push_back(Vec3::Zero());
    }
    state.plastic_strain.assign(mesh.tets.size(), Mat3::Zero());
    stars = NodeStars(mesh.tets, mesh.node_count());
    fem::update_elements(rest, mesh.tets, state.x, state.plastic_strain, pool, elements);
  }

  SplitReport step(std::uint64_t step = 0) {
    return fracture_step(rest, elements, 1, step, pool, mesh.tets, state, stars, scratch);
  }

  TetMesh mesh;
  ThreadPool pool;
  fem::RestBody rest;
  fem::FemState state;
  fem::Elements elements;
  NodeStars stars;
  FractureScratch scratch;
  Vec3 axis = Vec3::UnitX();
};

TEST(FractureStep, BreaksWhereStressPassesTheToughness) {
  EXPECT_TRUE(Bar(0.01 * (1 - 1e-9), 1).step().splits.empty());  // E strain = 1e5 Pa = toughness
  Bar bar(0.01 * (1 + 1e-9), 1);
  const double energy = fem::elastic_energy(bar.rest, bar.mesh.tets, bar.state.x, bar.state.plastic_strain);
  const double mass = bar.rest.mass();
  const SplitReport report = bar.step();
  EXPECT_GE(find_fragments(bar.mesh.tets).count(), 2);
  for (const NodeSplit& split : report.splits) EXPECT_NEAR(std::abs(split.normal.dot(bar.axis)), 1, 1e-9);

  fem::follow_topology(bar.rest, bar.mesh.tets, static_cast<int>(bar.state.x.size()));
  EXPECT_NEAR(bar.rest.mass(), mass, 1e-12 * mass);
  EXPECT_EQ(fem::elastic_energy(bar.rest, bar.mesh.tets, bar.state.x, bar.state.plastic_strain), energy);
}

TEST(FractureStep, PartlyFilledTetsHaveTheSameStrength) {
  EXPECT_TRUE(Bar(0.01 * (1 - 1e-9), 1, 0.3).step().splits.empty());
  EXPECT_FALSE(Bar(0.01 * (1 + 1e-9), 1, 0.3).step().splits.empty());
}

TEST(FractureStep, RawToughnessIsAForce) {
  Bar bar(0.01, 1);  // 1e5 Pa on H^2 = 0.01 m^2: 1000 N at an interior node (F10)
  bar.rest.material.raw_toughness = true;
  bar.rest.material.toughness = 1000 * (1 + 1e-9);
  EXPECT_TRUE(bar.step().splits.empty());
  bar.rest.material.toughness = 1000 * (1 - 1e-9);
  EXPECT_FALSE(bar.step().splits.empty());
}

TEST(FractureStep, OnlyBreakableMaterialsOnlyEveryInterval) {
  Bar bar(0.02, 1);
  bar.rest.material.breakable = false;
  EXPECT_TRUE(bar.step().splits.empty());
  bar.rest.material.breakable = true;
  bar.rest.material.fracture_interval = 3;
  EXPECT_TRUE(bar.step(4).splits.empty());
  EXPECT_FALSE(bar.step(6).splits.empty());
}

TEST(FractureStep, ACompressedBarHolds) { EXPECT_TRUE(Bar(-0.5, 1).step().splits.empty()); }

// The cascade of STABILITY row 23: ten times the strength, a limit of splits a step, until nothing is left to break.
TEST(FractureStep, ShatteringKeepsTheLimitAndEnds) {
  Bar bar(0.1, 1);
  bar.rest.material.max_splits_per_step = 10;
  int steps = 0;
  for (;; ++steps) {
    ASSERT_LT(steps, 200);
    const SplitReport report = bar.step(steps);
    EXPECT_LE(report.splits.size(), 10u);
    if (report.splits.empty()) break;
  }
  const Fragments fragments = find_fragments(bar.mesh.tets);
  EXPECT_GE(steps, 3);
  EXPECT_GE(fragments.count(), 4);
  for (const int size : fragments.size) EXPECT_GE(size, kMinFragmentTets);
}

TEST(FractureStep, SameBitsForOneAndTwoThreads) {
  Bar one(0.02, 1), two(0.02, 2);
  const SplitReport a = one.step(7), b = two.step(7);
  EXPECT_FALSE(a.splits.empty());
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(one.mesh.tets, two.mesh.tets);
  EXPECT_EQ(one.state.x, two.state.x);
}

}  // namespace
}  // namespace crumple::sim::fracture
