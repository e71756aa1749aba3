// Fracture of bodies whose tets are of several materials.
#include "server/sim/fracture/fracture_step.h"

#include "server/sim/fracture/fragments.h"
#include "tests/sim/fracture/uniform_stress.h"
#include "tests/support/kuhn_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace crumple::sim::fracture {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

Vec3 centroid(const TetMesh& mesh, int t) {
  Vec3 sum = Vec3::Zero();
  for (const int n : mesh.tets[t]) sum += mesh.X[n] / 4;
  return sum;
}

// Layers of two materials, 0 below z = 0.2 and 1 above, each under a stress of its own.
struct Layers {
  Layers(const Mat3& below, const Mat3& above) : mesh(test::kuhn_lattice({4, 4, 4}, 0.1)), pool(1) {
    stars = NodeStars(mesh.tets, mesh.node_count());
    normals = rest_normals(mesh);
    for (int t = 0; t < mesh.tet_count(); ++t) {
      id.push_back(centroid(mesh, t).z() > 0.2);
      stress.push_back(id.back() ? above : below);
    }
    S.resize(mesh.node_count());
    separation_tensors(mesh.tets, stars, stress, normals, pool, forces, S);
  }

  std::vector<SplitCandidate> candidates(double toughness_below, double toughness_above) const {
    const Toughness toughness{.of_material = {toughness_below, toughness_above}, .material_id = id};
    return split_candidates(mesh.tets, stars, normals, forces, S, toughness, pool);
  }
  // The candidate in the middle of the interface; strength 0: none.
  SplitCandidate at_interface(double toughness_below, double toughness_above) const {
    for (const SplitCandidate& c : candidates(toughness_below, toughness_above))
      if ((mesh.X[c.node] - Vec3(0.2, 0.2, 0.2)).norm() < 1e-9) return c;
    return {};
  }

  TetMesh mesh;
  ThreadPool pool;
  NodeStars stars;
  std::vector<std::uint16_t> id;
  std::vector<Mat3> stress;
  std::vector<Mat34> normals;
  PartForces forces;
  std::vector<Mat3> S;
};

TEST(SeveralMaterials, StrengthOfABondIsTheTractionAcrossIt) {
  const double s = 1e4;
  const Layers pulled(uniaxial(Vec3::UnitZ(), s), uniaxial(Vec3::UnitZ(), s));
  const SplitCandidate bond = pulled.at_interface(kNever, 1);
  EXPECT_NEAR(bond.strength, s, 1e-9 * s);
  EXPECT_NEAR(std::abs(bond.normal.z()), 1, 1e-9);
  EXPECT_EQ(pulled.at_interface(kNever, s * (1 + 1e-6)).strength, 0);
  // Nodes inside what never gives way are none; pressed layers do not part.
  for (const SplitCandidate& c : pulled.candidates(kNever, 1)) EXPECT_GT(pulled.mesh.X[c.node].z(), 0.2 - 1e-9);
  EXPECT_TRUE(pulled.candidates(kNever, kNever).empty());
  const Layers pressed(uniaxial(Vec3::UnitZ(), -s), uniaxial(Vec3::UnitZ(), -s));
  EXPECT_TRUE(pressed.candidates(kNever, 1).empty());
}

// A stiff layer carries a hundred times the stress along the interface. The weak one breaks by its own.
TEST(SeveralMaterials, WhatAFrameCarriesDoesNotBreakTheGlassInIt) {
  const double glass = 1e4;
  const Layers along(uniaxial(Vec3::UnitX(), 100 * glass), uniaxial(Vec3::UnitX(), glass));
  for (const double of_frame : {kNever, 1e9}) {
    const SplitCandidate c = along.at_interface(of_frame, 1);
    EXPECT_NEAR(c.strength, glass, 1e-9 * glass);
    EXPECT_NEAR(std::abs(c.normal.x()), 1, 1e-9);
    EXPECT_EQ(along.at_interface(of_frame, 1.01 * glass).strength, 0);
  }
  // Taken for one material the node bears the mean of both.
  const auto blind = split_candidates(along.mesh.tets, along.stars, along.normals, along.S, 1, false, along.pool);
  EXPECT_GT(std::ranges::max(blind, {}, &SplitCandidate::strength).strength, 50 * glass);
}

TEST(SeveralMaterials, TheWeakestThatGivesWayCounts) {
  const Mat3 pull = uniaxial(Vec3::UnitX(), 1);
  const Layers equal(5e4 * pull, 5e4 * pull);
  EXPECT_EQ(equal.at_interface(1e5, 1e4).toughness, 1e4);
  EXPECT_EQ(equal.at_interface(1e4, 1e5).toughness, 1e4);
  EXPECT_EQ(Layers(3e5 * pull, 3e5 * pull).at_interface(1e5, 1e4).toughness, 1e4);
  // The weak layer is not pulled, the tough one is: then both are parted, at its toughness.
  const SplitCandidate tough = Layers(4e5 * pull, 5e3 * pull).at_interface(1e5, 1e4);
  EXPECT_EQ(tough.toughness, 1e5);
  EXPECT_GT(tough.strength, 1e5);
}

// Node splits of any kind and number: tets that never give way keep every node that they had in common.
TEST(SeveralMaterials, TetsThatNeverGiveWayAreNeverParted) {
  TetMesh mesh = test::kuhn_lattice({5, 5, 5}, 0.1);
  const TetMesh before = mesh;
  std::mt19937 random(3);
  std::vector<std::uint16_t> id;
  for (int t = 0; t < mesh.tet_count(); ++t) id.push_back(random() % 4 == 0);
  const Toughness toughness{.of_material = {1, kNever}, .material_id = id};
  fem::FemState state{mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), {}};
  NodeStars stars(mesh.tets, mesh.node_count());
  int splits = 0;
  for (std::uint64_t step = 0; step < 60; ++step) {
    std::vector<SplitCandidate> candidates;
    for (int n = 0; n < stars.node_count(); ++n) {
      if (random() % 8) continue;
      std::normal_distribution<double> normal;
      const Vec3 e = Vec3::NullaryExpr([&] { return normal(random); }).normalized();
      candidates.push_back({n, e, 2, 1});
    }
    splits += static_cast<int>(split_nodes(mesh.tets, state, stars, candidates, toughness, {.step = step}).splits.size());
  }
  EXPECT_GT(splits, 100);
  EXPECT_GT(find_fragments(mesh.tets).count(), 1);
  std::vector<int> now(before.X.size(), -1);  // of each node of before, what its steel tets call it
  for (int t = 0; t < mesh.tet_count(); ++t) {
    if (id[t] == 0) continue;
    for (int k = 0; k < 4; ++k) {
      int& name = now[before.tets[t][k]];
      if (name < 0) name = mesh.tets[t][k];
      EXPECT_EQ(mesh.tets[t][k], name);
    }
  }
  for (const int size : find_fragments(mesh.tets).size) EXPECT_GE(size, kMinFragmentTets);
}

// A bar along x whose middle third is glass, stretched: everything bears E strain.
struct GlazedBar {
  explicit GlazedBar(double strain, int threads = 1, fem::FractureOrder order = fem::FractureOrder::random)
      : mesh(test::kuhn_lattice({9, 3, 3}, 0.1)), before(mesh), pool(threads) {
    fem::FemMaterial steel;
    steel.young = 1e7;
    steel.poisson = 0;
    steel.fracture_order = order;
    fem::MaterialRegion glass{{}, steel};
    glass.material.breakable = true;
    glass.material.toughness = 1e5;
    for (int t = 0; t < mesh.tet_count(); ++t)
      if (std::abs(centroid(mesh, t).x() - 0.45) < 0.15) glass.tets.push_back(t);
    rest = *fem::make_rest_body(mesh, steel, 0, std::span(&glass, 1));
    for (const Vec3& X : mesh.X) state.x.push_back({(1 + strain) * X.x(), X.y(), X.z()});
    state.v.assign(mesh.X.size(), Vec3::Zero());
    state.plastic_strain.assign(mesh.tets.size(), Mat3::Zero());
    stars = NodeStars(mesh.tets, mesh.node_count());
    fem::update_elements(rest, mesh.tets, state.x, state.plastic_strain, pool, elements);
  }
  SplitReport step(std::uint64_t step) {
    return fracture_step(rest, elements, 1, step, pool, mesh.tets, state, stars, scratch);
  }

  TetMesh mesh, before;
  ThreadPool pool;
  fem::RestBody rest;
  fem::FemState state;
  fem::Elements elements;
  NodeStars stars;
  FractureScratch scratch;
};

TEST(SeveralMaterials, ABarBreaksInItsGlassAndAtItsBonds) {
  EXPECT_TRUE(GlazedBar(0.01 * (1 - 1e-9)).step(0).splits.empty());
  for (const auto order : {fem::FractureOrder::random, fem::FractureOrder::largest_first}) {
    GlazedBar bar(0.02, 1, order);
    int splits = 0, at_bonds = 0;
    for (std::uint64_t k = 0; k < 20; ++k) {
      const SplitReport report = bar.step(k);
      splits += static_cast<int>(report.splits.size());
      for (const NodeSplit& split : report.splits) {
        const double X = split.point.x() / 1.02;
        EXPECT_GT(X, 0.3 - 1e-9);
        EXPECT_LT(X, 0.6 + 1e-9);
        at_bonds += std::min(std::abs(X - 0.3), std::abs(X - 0.6)) < 1e-9;
      }
    }
    EXPECT_GT(splits, 10);
    EXPECT_GT(at_bonds, 0);
    // The two ends are whole, and there is glass that left both.
    const Fragments pieces = find_fragments(bar.mesh.tets);
    std::vector<int> of_steel[2];
    for (int t = 0; t < bar.mesh.tet_count(); ++t) {
      if (bar.rest.material_id[t] != 0) continue;
      std::vector<int>& end = of_steel[centroid(bar.before, t).x() > 0.45];
      end.push_back(pieces.of_tet[t]);
      EXPECT_EQ(end.back(), end.front());
    }
    EXPECT_NE(of_steel[0].front(), of_steel[1].front());
  }
}

TEST(SeveralMaterials, SameBitsForOneAndTwoThreads) {
  for (const auto order : {fem::FractureOrder::random, fem::FractureOrder::largest_first}) {
    GlazedBar one(0.02, 1, order), two(0.02, 2, order);
    const SplitReport a = one.step(7), b = two.step(7);
    EXPECT_FALSE(a.splits.empty());
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(one.mesh.tets, two.mesh.tets);
  }
}

TEST(SeveralMaterials, TheBodysOwnMaterialNeedNotBeTheOneThatBreaks) {
  GlazedBar bar(0.02);
  EXPECT_FALSE(bar.rest.material.breakable);
  EXPECT_TRUE(bar.rest.breakable());
  bar.rest.others[0].material.breakable = false;
  EXPECT_TRUE(bar.step(0).splits.empty());
  bar.rest.others[0].material.breakable = true;
  bar.rest.material.fracture_interval = 3;  // the body's
  EXPECT_TRUE(bar.step(1).splits.empty());
  EXPECT_FALSE(bar.step(3).splits.empty());
}

}  // namespace
}  // namespace crumple::sim::fracture
