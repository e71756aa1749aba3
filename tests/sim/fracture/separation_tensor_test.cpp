#include "server/sim/fracture/separation_tensor.h"

#include "tests/sim/fracture/uniform_stress.h"
#include "tests/support/kuhn_lattice.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

namespace crumple::sim::fracture {
namespace {

constexpr double H = 0.1;                          // [m]
constexpr std::array<int, 3> kCells{4, 4, 4};
const TetMesh& lattice() {
  static const TetMesh mesh = test::kuhn_lattice(kCells, H);
  return mesh;
}
int node(int i, int j, int k) { return i + 5 * (j + 5 * k); }
const int kInterior = node(2, 2, 2);

Vec3 eigenvalues(const Mat3& S) { return Eigen::SelfAdjointEigenSolver<Mat3>(S).eigenvalues(); }

TEST(SeparationTensor, OuterByLengthHasOneEigenvalueTheLength) {
  const Vec3 a(1, -2, 2);
  EXPECT_TRUE((outer_by_length(a) * a).isApprox(3 * a));
  EXPECT_DOUBLE_EQ(outer_by_length(a).trace(), 3);
  EXPECT_EQ(outer_by_length(Vec3::Zero()), Mat3::Zero());
}

// The reference's numbers (FORMULAS F10) for unit stress and unit area H^2, to the digits they are given with.
TEST(SeparationTensor, UniaxialTensionOnAnInteriorNodeIsH2InTheAxes) {
  for (int axis = 0; axis < 3; ++axis) {
    const UniformStress field(lattice(), uniaxial(Vec3::Unit(axis), 1));
    EXPECT_NEAR(eigenvalues(field.S[kInterior])[2] / (H * H), 1, 1e-6);
    EXPECT_NEAR(eigenvalues(field.S[kInterior])[1] / (H * H), 0, 1e-6);
  }
}

TEST(SeparationTensor, DirectionDependenceIsTheReferences) {
  const auto strength = [](const Vec3& d) {
    return eigenvalues(UniformStress(lattice(), uniaxial(d, 1)).S[kInterior])[2] / (H * H);
  };
  EXPECT_NEAR(strength({1, 1, 0}), 2 * std::sqrt(2) / 3, 1e-6);   // .943
  EXPECT_NEAR(strength({1, -1, 0}), std::sqrt(2), 1e-6);          // 1.414
  EXPECT_NEAR(strength({1, 1, 1}), 1 / std::sqrt(3), 1e-6);       // .577
}

TEST(SeparationTensor, SurfaceNodesOfABarAreWeaker) {
  const UniformStress field(lattice(), uniaxial(Vec3::UnitX(), 1));
  const auto area = [&](int n) { return eigenvalues(field.S[n])[2] / (H * H); };
  for (const int side : {node(2, 0, 2), node(2, 4, 2), node(2, 2, 0), node(2, 2, 4)}) EXPECT_NEAR(area(side), 0.5, 1e-6);
  std::multimap<int, int> edges;  // sixths of H^2 -> node
  for (const int edge : {node(2, 0, 0), node(2, 4, 0), node(2, 0, 4), node(2, 4, 4)}) {
    const double sixths = 6 * area(edge);
    EXPECT_NEAR(sixths, std::round(sixths), 6e-6);
    edges.emplace(static_cast<int>(std::lround(sixths)), edge);
  }
  EXPECT_EQ(edges.count(2), 2u);  // H^2 / 3
  EXPECT_EQ(edges.count(1), 2u);  // H^2 / 6
}

TEST(SeparationTensor, LoadedEndsDoNotSeparate) {
  // All tets of an end node pull it inward: the unbalanced sum is the load's to carry.
  const UniformStress field(lattice(), uniaxial(Vec3::UnitX(), 1));
  EXPECT_LT(eigenvalues(field.S[node(0, 2, 2)])[2], 1e-6 * H * H);
  EXPECT_LT(eigenvalues(field.S[node(4, 2, 2)])[2], 1e-6 * H * H);
}

TEST(SeparationTensor, HydrostaticTensionAndPureShearAreTheReferences) {
  const Vec3 hydrostatic = eigenvalues(UniformStress(lattice(), Mat3::Identity()).S[kInterior]) / (H * H);
  EXPECT_NEAR(hydrostatic[2], 1.0404, 5e-5);  // four digits are given
  EXPECT_NEAR(hydrostatic[2], hydrostatic[1], 1e-6);
  Mat3 shear = Mat3::Zero();
  shear(0, 1) = shear(1, 0) = 1;
  EXPECT_NEAR(eigenvalues(UniformStress(lattice(), shear).S[kInterior])[2] / (H * H), 0.9428, 5e-5);
}

TEST(SeparationTensor, UniformCompressionNeverSeparates) {
  const auto expect_none = [](const UniformStress& field, int n) {
    EXPECT_LE(eigenvalues(field.S[n])[2], 1e7 * H * H * 1e-12);  // rounding
  };
  const UniformStress squeezed(lattice(), uniaxial(Vec3(1, 2, -1), -1e7));
  for (int n = 0; n < lattice().node_count(); ++n) expect_none(squeezed, n);
  EXPECT_TRUE(split_candidates(lattice().tets, squeezed.stars, squeezed.normals, squeezed.S, 1, false, squeezed.pool).empty());
  const UniformStress pressed(lattice(), -1e7 * Mat3::Identity());
  for (int n = 0; n < lattice().node_count(); ++n) {
    const Vec3& X = lattice().X[n];
    if (X.minCoeff() > 0 && X.maxCoeff() < 0.4 - 1e-9) expect_none(pressed, n);  // the surface carries a load
  }
}

TEST(SeparationTensor, TurnsWithTheBody) {
  Mat3 sigma;
  sigma << 3, 1, 0, 1, -2, 0.5, 0, 0.5, 1;
  const Mat3 R = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  TetMesh turned = lattice();
  for (Vec3& X : turned.X) X = R * X;
  const UniformStress before(lattice(), sigma), after(turned, R * sigma * R.transpose());
  for (int n = 0; n < lattice().node_count(); ++n)
    EXPECT_LT((after.S[n] - R * before.S[n] * R.transpose()).norm(), 1e-12 * H * H * sigma.norm() * 100);
}

TEST(SplitCandidates, AreaNormalisedStrengthIsTheAppliedStress) {
  for (const Vec3& d : {Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(1, -1, 0), Vec3(1, 1, 1), Vec3(3, -1, 2)}) {
    const double s = 1e4;
    const UniformStress field(lattice(), uniaxial(d, s));
    const auto candidates = split_candidates(lattice().tets, field.stars, field.normals, field.S, 0, false, field.pool);
    const auto found = std::ranges::find(candidates, kInterior, &SplitCandidate::node);
    ASSERT_NE(found, candidates.end());
    EXPECT_NEAR(found->strength, s, 1e-9 * s);
    EXPECT_NEAR(std::abs(found->normal.dot(d.normalized())), 1, 1e-12);
  }
}

TEST(SplitCandidates, ToughnessInPascalDoesNotDependOnTheMeshAndInNewtonsDoes) {
  const double s = 1e4;
  const Vec3 x = Vec3::UnitX();
  const TetMesh fine = test::kuhn_lattice({8, 8, 8}, H / 2);
  const auto strongest = [&](const TetMesh& mesh, bool raw) {
    const UniformStress field(mesh, uniaxial(x, s));
    double strength = 0;
    for (const auto& c : split_candidates(mesh.tets, field.stars, field.normals, field.S, 0, raw, field.pool))
      strength = std::max(strength, c.strength);
    return strength;
  };
  EXPECT_NEAR(strongest(lattice(), false), s, 1e-9 * s);
  EXPECT_NEAR(strongest(fine, false), s, 1e-9 * s);
  EXPECT_NEAR(strongest(lattice(), true), 100, 1e-4);  // F10: tau = 100 N <-> s_c = 1e4 Pa at H = 0.1
  EXPECT_NEAR(strongest(fine, true), 25, 1e-4);        // H/2: a quarter, so s_c x 4
}

TEST(SplitCandidates, OnlyThoseAboveTheToughness) {
  const UniformStress field(lattice(), uniaxial(Vec3::UnitX(), 1e4));
  const auto count = [&](double toughness) {
    return split_candidates(lattice().tets, field.stars, field.normals, field.S, toughness, false, field.pool).size();
  };
  EXPECT_EQ(count(1e4 * (1 + 1e-6)), 0u);
  EXPECT_EQ(count(1e4 * (1 - 1e-6)), 3u * 5 * 5);  // all but the two ends
}

TEST(SplitCandidates, ABrokenTensorGivesNone) {
  UniformStress field(lattice(), uniaxial(Vec3::UnitX(), 1e4));
  const auto before = split_candidates(lattice().tets, field.stars, field.normals, field.S, 1, false, field.pool).size();
  field.S[kInterior](1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(split_candidates(lattice().tets, field.stars, field.normals, field.S, 1, false, field.pool).size(), before - 1);
}

TEST(SeparationTensor, SameBitsForAnyNumberOfThreads) {
  const TetMesh mesh = test::kuhn_lattice({9, 9, 9}, H);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto run = [&](int threads) {
    UniformStress field(mesh, Mat3::Zero(), threads);
    std::mt19937 same = random;
    for (Mat3& sigma : field.stress) {
      Mat3 A;
      for (int i = 0; i < 9; ++i) A.data()[i] = normal(same);
      sigma = A + A.transpose();
    }
    normal.reset();
    PartForces forces;
    separation_tensors(mesh.tets, field.stars, field.stress, field.normals, field.pool, forces, field.S);
    return std::pair(field.S, split_candidates(mesh.tets, field.stars, field.normals, field.S, 1, false, field.pool));
  };
  const auto one = run(1), two = run(2);
  EXPECT_EQ(one.first, two.first);
  ASSERT_EQ(one.second.size(), two.second.size());
  EXPECT_GT(one.second.size(), 100u);
  for (std::size_t i = 0; i < one.second.size(); ++i) {
    EXPECT_EQ(one.second[i].node, two.second[i].node);
    EXPECT_EQ(one.second[i].strength, two.second[i].strength);
  }
}

}  // namespace
}  // namespace crumple::sim::fracture
