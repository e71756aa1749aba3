#include "server/sim/contact/tet_overlap.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::contact {
namespace {

constexpr std::uint8_t kAllFaces = 15;

Mat34 corner_tet(const Vec3& at, double size = 1) {
  Mat34 x;
  x << at, at + size * Vec3::UnitX(), at + size * Vec3::UnitY(), at + size * Vec3::UnitZ();
  return x;
}

Mat34 columns(const TetMesh& mesh, int t, const Vec3& shift = Vec3::Zero()) {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = mesh.X[mesh.tets[t][k]] + shift;
  return x;
}

Vec3 random_point(std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

Mat34 random_tet(std::mt19937& random) {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = random_point(random);
  return x;
}

// Uniform in the tet: barycentric weights are the spacings of three sorted uniform numbers.
Vec3 random_inside(const Mat34& x, std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1);
  std::array<double, 3> s{u(random), u(random), u(random)};
  std::sort(s.begin(), s.end());
  return x * Eigen::Vector4d(s[0], s[1] - s[0], s[2] - s[1], 1 - s[2]);
}

Vec3 face_sum(const TetOverlap& o) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& a : o.face_area) sum += a;
  return sum;
}

TEST(TetOverlap, CornerTetsShiftedAlongTheDiagonalMeetInASmallerCornerTet) {
  const double s = 0.1;  // x, y, z >= s and x + y + z <= 1: a corner tet of edge 1 - 3 s
  const TetOverlap o = overlap(orient(corner_tet(Vec3::Zero())), orient(corner_tet(Vec3::Constant(s))));
  EXPECT_NEAR(o.volume, std::pow(1 - 3 * s, 3) / 6, 1e-15);
  EXPECT_LT((o.centroid - Vec3::Constant(s + (1 - 3 * s) / 4)).norm(), 1e-14);
  // The sloping face is the first's, the three others the second's.
  const double leg = 0.5 * (1 - 3 * s) * (1 - 3 * s);
  EXPECT_LT((o.face_area[0] - leg * Vec3::Ones()).norm(), 1e-14);
  for (int k = 1; k < 4; ++k) EXPECT_EQ(o.face_area[k].norm(), 0);
  EXPECT_EQ(o.face_area[4].norm(), 0);
  EXPECT_LT((o.face_area[5] + leg * Vec3::UnitX()).norm(), 1e-14);
}

TEST(TetOverlap, OfATetWithItselfIsTheTet) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const OrientedTet tet = orient(random_tet(random));
    const TetOverlap o = overlap(tet, tet);
    EXPECT_NEAR(o.volume, tet.volume, 1e-13);
    EXPECT_LT((o.centroid - tet.x.rowwise().mean()).norm(), 1e-11);
    EXPECT_LT(face_sum(o).norm(), 1e-13);
  }
}

TEST(TetOverlap, OfTwoCubesOfTetsIsTheBoxTheyShare) {
  const TetMesh cube = test::kuhn_lattice({2, 2, 2}, 0.5);
  const Vec3 shift(0.3, -0.2, 0.75);  // off the lattice: no faces coincide
  const Vec3 low(0.3, 0, 0.75), high(1, 0.8, 1);
  double volume = 0;
  Vec3 moment = Vec3::Zero();
  for (int i = 0; i < cube.tet_count(); ++i)
    for (int j = 0; j < cube.tet_count(); ++j) {
      const TetOverlap o = overlap(orient(columns(cube, i)), orient(columns(cube, j, shift)));
      volume += o.volume;
      moment += o.volume * o.centroid;
    }
  EXPECT_NEAR(volume, (high - low).prod(), 1e-13);
  EXPECT_LT((moment / volume - 0.5 * (low + high)).norm(), 1e-12);
}

TEST(TetOverlap, OfTwoCubesThatCoincideIsTheCube) {  // every face lies in a face: nothing may be counted twice
  const TetMesh cube = test::kuhn_lattice({1, 1, 1}, 1);
  double volume = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const TetOverlap o = overlap(orient(columns(cube, i)), orient(columns(cube, j)));
      if (i != j) { EXPECT_EQ(o.volume, 0) << "neighbours only touch"; }
      volume += o.volume;
    }
  EXPECT_NEAR(volume, 1, 1e-14);
}

TEST(TetOverlap, AgreesWithMonteCarlo) {
  std::mt19937 random(11);
  int overlapping = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const OrientedTet a = orient(random_tet(random)), b = orient(random_tet(random));
    const TetOverlap o = overlap(a, b);
    const int samples = 20000;
    int hits = 0;
    Vec3 sum = Vec3::Zero();
    for (int s = 0; s < samples; ++s) {
      const Vec3 p = random_inside(a.x, random);
      if (barycentric(b, p).minCoeff() < 0) continue;
      ++hits;
      sum += p;
    }
    const double share = static_cast<double>(hits) / samples;
    EXPECT_NEAR(o.volume / a.volume, share, 5 * std::sqrt(share * (1 - share) / samples) + 1e-3) << trial;
    if (hits < 500) continue;
    ++overlapping;
    EXPECT_LT((o.centroid - sum / hits).norm(), 5 * 1.0 / std::sqrt(hits));
  }
  EXPECT_GT(overlapping, 10);
}

TEST(TetOverlap, FacesCloseAndNeitherOrderNorInversionMatters) {
  std::mt19937 random(5);
  int overlapping = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Mat34 x = random_tet(random);
    const OrientedTet a = orient(x), b = orient(random_tet(random));
    x.col(2).swap(x.col(3));
    const OrientedTet mirrored = orient(x);
    const TetOverlap ab = overlap(a, b), ba = overlap(b, a), mb = overlap(mirrored, b);
    EXPECT_NEAR(ab.volume, ba.volume, 1e-14);
    EXPECT_NEAR(ab.volume, mb.volume, 1e-14);
    if (ab.volume == 0) continue;
    ++overlapping;
    EXPECT_LT(face_sum(ab).norm(), 1e-13);
    EXPECT_LT((ab.centroid - ba.centroid).norm() * ab.volume, 1e-14);  // of slivers: rounding over volume
    const Vec3 r = contact_normal(ab, a, b, 5, 9).r;
    EXPECT_LT((r + contact_normal(ba, b, a, 9, 5).r).norm(), 1e-10 * r.norm() + 1e-13);
  }
  EXPECT_GT(overlapping, 100);
}

TEST(TetOverlap, TouchingTetsDoNotOverlap) {
  const OrientedTet a = orient(corner_tet(Vec3::Zero()));
  Mat34 below = corner_tet(Vec3::Zero());
  below.col(3) = -Vec3::UnitZ();  // shares the face z = 0
  EXPECT_EQ(overlap(a, orient(below)).volume, 0);
  EXPECT_EQ(overlap(a, orient(corner_tet(Vec3::UnitX()))).volume, 0);  // shares a corner
}

TEST(TetOverlap, FlatTetsAreMarked) {
  Mat34 flat = corner_tet(Vec3::Zero());
  flat.col(3) = Vec3(0.3, 0.3, 0);
  EXPECT_EQ(orient(flat).volume, 0);
  flat.col(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(orient(flat).volume, 0);
}

TEST(TetOverlap, BarycentricWeightsReproduceThePoint) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const OrientedTet tet = orient(random_tet(random));
    const Vec3 p = random_point(random);
    const Eigen::Vector4d b = barycentric(tet, p);
    EXPECT_NEAR(b.sum(), 1, 1e-15 * (1 + b.cwiseAbs().sum()));
    EXPECT_LT((tet.x * b - p).norm(), 1e-10 * b.cwiseAbs().maxCoeff());
  }
}

TEST(HalfSpace, CutsACornerTetByTheClosedForm) {
  const OrientedTet tet = orient(corner_tet(Vec3::Zero()));
  for (const double h : {1e-6, 0.1, 0.5, 0.9}) {
    const HalfSpaceOverlap o = overlap(tet, Vec3::UnitZ(), h);
    const double top = 1 - h, volume = (1 - top * top * top) / 6;
    EXPECT_NEAR(o.volume, volume, 1e-14);
    EXPECT_NEAR(o.area, 0.5 * top * top, 1e-14);
    // z-moment of the whole (1/24) less that of the small tet cut off (its centroid at h + top/4).
    const double moment = 1.0 / 24 - top * top * top / 6 * (h + top / 4);
    EXPECT_NEAR(o.centroid.z() * volume, moment, 1e-14);
  }
  EXPECT_EQ(overlap(tet, Vec3::UnitZ(), 0).volume, 0);
  EXPECT_EQ(overlap(tet, Vec3::UnitZ(), -1).volume, 0);
}

TEST(HalfSpace, TakesAWholeTetWithoutACut) {
  const OrientedTet tet = orient(corner_tet(Vec3(1, 2, -3)));
  const HalfSpaceOverlap o = overlap(tet, Vec3::UnitZ(), 0);
  EXPECT_NEAR(o.volume, 1.0 / 6, 1e-14);
  EXPECT_LT((o.centroid - tet.x.rowwise().mean()).norm(), 1e-13);
  EXPECT_EQ(o.area, 0);
}

TEST(HalfSpace, CutsOfACubeAddUpToItsCrossSection) {
  const TetMesh cube = test::kuhn_lattice({2, 2, 2}, 0.5);
  const Vec3 n = Vec3(1, 1, 0).normalized();
  double volume = 0, area = 0;
  for (int t = 0; t < cube.tet_count(); ++t) {
    const HalfSpaceOverlap o = overlap(orient(columns(cube, t)), n, 0.6 / std::sqrt(2.0));
    volume += o.volume;
    area += o.area;
  }
  EXPECT_NEAR(volume, 0.5 * 0.6 * 0.6, 1e-13);
  EXPECT_NEAR(area, 0.6 * std::sqrt(2.0), 1e-13);
}

TEST(ContactNormal, OfAFlatContactIsTheFaceAndNotTheMeshersCuts) {
  const TetMesh cube = test::kuhn_lattice({1, 1, 1}, 1);
  const Vec3 shift(0.25, 0.15, 1 - 1e-3);
  const auto faces_at = [&](int t, double z) {  // exterior mask of the faces at height z
    std::uint8_t mask = 0;
    for (int k = 0; k < 4; ++k) {
      bool flat = true;
      for (int m = 0; m < 4; ++m) flat = flat && (m == k || cube.X[cube.tets[t][m]].z() == z);
      if (flat) mask |= static_cast<std::uint8_t>(1 << k);
    }
    return mask;
  };
  Vec3 total = Vec3::Zero();
  double volume = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const OrientedTet a = orient(columns(cube, i, shift)), b = orient(columns(cube, j));
      const TetOverlap o = overlap(a, b);
      if (o.volume == 0) continue;
      const ContactNormal normal = contact_normal(o, a, b, faces_at(i, 0), faces_at(j, 1));
      EXPECT_EQ(normal.from_surface, faces_at(i, 0) != 0 || faces_at(j, 1) != 0);
      volume += o.volume;
      if (!normal.from_surface) continue;
      EXPECT_LT(normal.r.head<2>().norm(), 1e-12);
      total += normal.r;
    }
  EXPECT_NEAR(volume, 0.75 * 0.85 * 1e-3, 1e-12);
  EXPECT_NEAR(total.z(), 0.75 * 0.85, 2e-3);  // wedges beside the cuts have only one of the two faces: order depth
}

// A slab of growing thickness t whose side alone belongs to the surface: its rim while t is small.
TEST(ContactNormal, ASurfaceThatIsMoreThanTheRimComesInWithNoWeight) {
  const OrientedTet a = orient(corner_tet(Vec3::Zero()));
  double before = 0;
  for (double t = 0.02; t < 0.6; t += 0.005) {
    Mat34 below;  // y < t
    below << Vec3(-10, t, -10), Vec3(20, t, -10), Vec3(-10, t, 20), Vec3(-5, -10, -5);
    const OrientedTet b = orient(below);
    const ContactNormal normal = contact_normal(overlap(a, b), a, b, 1 << 1, 0);
    EXPECT_EQ(normal.from_surface, t * (1 - t / 2) > 0.3 * 0.5) << t;
    if (!normal.from_surface) continue;
    EXPECT_LT((normal.r.normalized() - Vec3::UnitX()).norm(), 1e-12);
    EXPECT_GT(normal.weight, before - 1e-12);
    EXPECT_LT(normal.weight, before + 0.1) << t;
    before = normal.weight;
  }
  EXPECT_GT(before, 0.9);  // then the sloping face is the widest
}

TEST(ContactNormal, OfATetInsideAnotherPointsOutOfTheNearestSurfaceFace) {
  const OrientedTet small = orient(corner_tet(Vec3(0.2, 0.2, 0.05), 0.1));
  const OrientedTet large = orient(corner_tet(Vec3::Zero()));
  const TetOverlap o = overlap(small, large);
  EXPECT_NEAR(o.volume, small.volume, 1e-15);
  EXPECT_FALSE(contact_normal(o, small, large, 0, kAllFaces).from_surface);
  Vec3 r = contact_normal(o, small, large, 0, kAllFaces).r;
  EXPECT_GT(-r.normalized().z(), 1 - 1e-12);
  r = contact_normal(o, small, large, 0, 2).r;  // only the face x = 0 belongs to the surface
  EXPECT_GT(-r.normalized().x(), 1 - 1e-12);
  EXPECT_GT(r.norm(), 0);
}

TEST(OverlapDepth, IsThatOfASlabAndBoundedForSlivers) {
  EXPECT_DOUBLE_EQ(overlap_depth(2e-3, 2), 1e-3);
  EXPECT_DOUBLE_EQ(overlap_depth(1e-6, 1e-9), 1e-2);
  EXPECT_DOUBLE_EQ(overlap_depth(1e-6, 0), 1e-2);
}

}  // namespace
}  // namespace crumple::sim::contact
