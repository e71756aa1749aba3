#include "server/sim/contact/detect.h"
#include "server/sim/contact/found_rows.h"
#include "server/sim/contact/tet_overlap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::contact {
namespace {

const ThreadPool kOneThread(1);

// A cube of 48 tets and edge 1, 1000 kg, at `at`, moving with `velocity`.
struct Cube {
  TetMesh mesh = test::kuhn_lattice({2, 2, 2}, 0.5);
  CollisionMesh collision;
  std::vector<Vec3> x, v;
  std::vector<char> fixed;

  Cube(const Vec3& at, const Vec3& velocity) : x(mesh.X), v(mesh.X.size(), velocity), fixed(mesh.X.size(), 0) {
    collision = make_collision_mesh(mesh.tets, mesh.X, std::vector<double>(mesh.tets.size(), 1000.0 / 48));
    for (Vec3& p : x) p += at;
  }
  CollisionBody soft() const { return {&collision, x, v, fixed, std::nullopt, 0.5}; }
  CollisionBody rigid(const RigidMotion& motion) const { return {&collision, x, {}, {}, motion, 0.5}; }
};

DetectionInput input_of(std::span<const CollisionBody> bodies, std::span<const CollisionPlane> planes = {}) {
  DetectionInput input;
  input.bodies = bodies;
  input.planes = planes;
  input.gravity = Vec3(0, -9.81, 0);
  input.dt = 1.0 / 60;
  return input;
}

double total_area(const std::vector<ContactRow>& rows) {
  double area = 0;
  for (const ContactRow& row : rows) area += row.area;
  return area;
}

TEST(Detect, BodyThatWillReachThePlaneMayCloseItsGapAndNoMore) {
  const Cube cube(Vec3(0, 0.01, 0), Vec3(0, -1, 0));  // falls 17 mm + 2.7 mm in the step
  const std::vector<CollisionBody> bodies{cube.soft()};
  const std::vector<CollisionPlane> planes{{}};
  const DetectionInput input = input_of(bodies, planes);
  const std::vector<ContactRow> rows = detect(input, kOneThread);
  EXPECT_EQ(rows.size(), 9u);  // the nodes of the lower face
  for (const ContactRow& row : rows) {
    EXPECT_EQ(row.normal, Vec3(0, 1, 0));
    EXPECT_EQ(row.sides[0].body, 0);
    EXPECT_EQ(row.sides[1].body, 1);  // the plane
    ASSERT_EQ(row.sides[0].node_count, 1);
    EXPECT_EQ(row.sides[0].weights[0], 1);
    EXPECT_EQ(cube.mesh.X[row.sides[0].nodes[0]].y(), 0);
    EXPECT_NEAR(row.depth, -0.01, 1e-12);
    EXPECT_NEAR(row.target, -0.6, 1e-10);  // 10 mm in a step
    EXPECT_NEAR(row.c_n, 100 * 1000 * row.area, 1e-6 * row.c_n);
  }
  EXPECT_NEAR(total_area(rows), 1, 1e-12);
  EXPECT_EQ(deepest(rows), 0);
}

TEST(Detect, OverlapIsTakenBackOverTauAtABoundedSpeed) {
  for (const double depth : {0.02, 0.4}) {
    const Cube cube(Vec3(0, -depth, 0), Vec3(0, 9.81 / 60, 0));  // at rest at the end of the step
    const std::vector<CollisionBody> bodies{cube.soft()};
    const std::vector<CollisionPlane> planes{{}};
    const std::vector<ContactRow> rows = detect(input_of(bodies, planes), kOneThread);
    ASSERT_FALSE(rows.empty());
    for (const ContactRow& row : rows) {
      EXPECT_NEAR(row.depth, depth, 1e-12);
      EXPECT_NEAR(row.target, depth == 0.02 ? 0.3 : 1, 1e-10);
    }
  }
}

std::vector<ContactRow> rows_on_the_ground(const Cube& cube, const Vec3& before) {
  const std::vector<Vec3> v_before(cube.x.size(), before);
  std::vector<CollisionBody> bodies{cube.soft()};
  bodies[0].v_before = v_before;
  const std::vector<CollisionPlane> planes{{}};
  return detect(input_of(bodies, planes), kOneThread);
}

// It falls by 2.7 mm in a step if nothing holds it.
TEST(Detect, WhatGoesUpAndDownByTurnsIsLookedForWhereItIs) {
  const Vec3 up(0, 0.3, 0);
  EXPECT_TRUE(rows_on_the_ground(Cube(Vec3(0, 0.002, 0), up), up).empty());
  const std::vector<ContactRow> rows = rows_on_the_ground(Cube(Vec3(0, 0.002, 0), up), -up);
  EXPECT_EQ(rows.size(), 9u);
  for (const ContactRow& row : rows) EXPECT_NEAR(row.depth, -0.002, 1e-12);
  // 5 mm up in one step, down in the next, and there now: no deeper than it is.
  const std::vector<ContactRow> below = rows_on_the_ground(Cube(Vec3(0, -0.002, 0), -up), up);
  EXPECT_EQ(below.size(), 9u);
  for (const ContactRow& row : below) EXPECT_NEAR(row.depth, 0.002, 1e-12);
}

// By 100 mm a step: with the mean of both velocities it would be looked for half-way, or where it was.
TEST(Detect, WhatHasBeenThrownIsLookedForWithItsNewVelocity) {
  const Cube cube(Vec3(0, 0.09, 0), Vec3(0, -6, 0));
  EXPECT_EQ(rows_on_the_ground(cube, Vec3::Zero()).size(), 9u);
  EXPECT_EQ(rows_on_the_ground(cube, Vec3(0, 6, 0)).size(), 9u);
}

TEST(Detect, RawLawIsDampingOfWhatOverlapsNow) {
  const Cube above(Vec3(0, 0.001, 0), Vec3(0, -5, 0)), below(Vec3(0, -0.001, 0), Vec3(0, 5, 0));
  const std::vector<CollisionPlane> planes{{}};
  const std::vector<CollisionBody> apart{above.soft()}, overlapping{below.soft()};
  DetectionInput input = input_of(apart, planes);
  input.settings.raw_damping = true;
  input.settings.phi = 3e5;
  EXPECT_TRUE(detect(input, kOneThread).empty());
  input.bodies = overlapping;
  const std::vector<ContactRow> rows = detect(input, kOneThread);
  EXPECT_NEAR(total_area(rows), 1, 1e-9);  // the cuts add up to the cube's section
  for (const ContactRow& row : rows) {
    EXPECT_NEAR(row.c_n, 3e5 / 60 * row.area, 1e-12 * row.c_n);
    EXPECT_EQ(row.target, 0);
  }
}

// A cube that stands on one corner, 3 cm in another's upper face.
TEST(Detect, CornersOfSoftBodiesAreDeeperThanVolumeOverArea) {
  const Cube lower(Vec3::Zero(), Vec3::Zero());
  Cube upper(Vec3::Zero(), Vec3::Zero());
  const Mat3 R = Eigen::Quaterniond::FromTwoVectors(Vec3::Ones(), Vec3::UnitY()).toRotationMatrix();
  for (Vec3& p : upper.x) p = R * p + Vec3(0.6, 0.97, 0.55);
  const auto deepest_over_mean = [&](const std::vector<CollisionBody>& bodies, bool raw) {
    DetectionInput input = input_of(bodies);
    input.gravity.setZero();
    input.settings.raw_damping = raw;
    double most = 0;
    for (const ContactRow& row : detect(input, kOneThread)) {
      EXPECT_NEAR(row.normal.norm(), 1, 1e-12);
      most = std::max(most, row.depth / overlap_depth(row.volume, row.area));
    }
    return most;
  };
  RigidMotion held;
  held.movable = false;
  EXPECT_GT(deepest_over_mean({lower.soft(), upper.soft()}, false), 1.3);
  EXPECT_NEAR(deepest_over_mean({lower.soft(), upper.soft()}, true), 1, 1e-9);
  EXPECT_NEAR(deepest_over_mean({lower.rigid(held), upper.soft()}, false), 1, 1e-9);
}

TEST(Detect, HeldNodesHaveNoRowAgainstAPlane) {
  Cube cube(Vec3(0, -0.02, 0), Vec3::Zero());
  for (std::size_t n = 0; n < cube.fixed.size(); ++n) cube.fixed[n] = cube.mesh.X[n].x() == 0;
  const std::vector<CollisionBody> bodies{cube.soft()};
  const std::vector<CollisionPlane> planes{{}};
  const std::vector<ContactRow> rows = detect(input_of(bodies, planes), kOneThread);
  EXPECT_EQ(rows.size(), 6u);
  for (const ContactRow& row : rows) EXPECT_GT(cube.mesh.X[row.sides[0].nodes[0]].x(), 0);
}

TEST(Detect, StackedCubesMeetFaceToFace) {
  const Cube lower(Vec3(0, 0, 0), Vec3(0, 0, 0)), upper(Vec3(0.1, 0.99, 0.2), Vec3(0, 0, 0));
  const std::vector<CollisionBody> bodies{lower.soft(), upper.soft()};
  const std::vector<ContactRow> rows = detect(input_of(bodies), kOneThread);
  Vec3 r = Vec3::Zero();
  for (const ContactRow& row : rows) {
    r += row.area * row.normal;
    double weight = 0;
    for (const ContactSide& side : row.sides)
      for (int i = 0; i < side.node_count; ++i) weight += side.weights[i];
    EXPECT_NEAR(weight, 0, 1e-13);
    if (row.area > 0.01) {
      EXPECT_LT(row.normal.y(), -0.95);  // from the upper to the lower cube, which is side 0
      EXPECT_NEAR(row.c_n, 100 * 500 * row.area, 1e-6 * row.c_n);  // reduced mass
    }
  }
  EXPECT_NEAR(r.y(), -0.9 * 0.8, 0.02);
  EXPECT_LT(std::hypot(r.x(), r.z()), 0.03);
  EXPECT_NEAR(deepest(rows), 0.01, 1e-3);
}

// Shifted by some millimetres, tets of 0.5 m meet their neighbours' opposites in slivers of the same overlap.
TEST(Detect, SliversBesideRowsThatHoldTheSameNodesAreLeftOut) {
  const Cube lower(Vec3(0, 0, 0), Vec3(0, 0, 0)), upper(Vec3(0.003, 0.99, 0.002), Vec3(0, 0, 0));
  const std::vector<CollisionBody> bodies{lower.soft(), upper.soft()};
  const std::vector<ContactRow> rows = detect(input_of(bodies), kOneThread);
  int neighbours = 0;
  for (const ContactRow& row : rows)
    for (const ContactRow& other : rows)
      for (int side = 0; side < 2; ++side) {
        if (&row == &other || row.sides[side].tet != other.sides[side].tet) continue;
        if (!share_a_node(lower.mesh.tets[row.sides[1 - side].tet], lower.mesh.tets[other.sides[1 - side].tet])) continue;
        EXPECT_GE(row.area, 0.03 * other.area);
        ++neighbours;
      }
  EXPECT_GT(neighbours, 0);
  EXPECT_NEAR(total_area(rows), 1, 0.05);
}

// A bench with a leg of one and a half metres and one of a centimetre, on a floor of which one tet is below both.
TEST(Detect, ANarrowFootOnAWideTetHasRowsOfItsOwn) {
  TetMesh bench = test::kuhn_lattice({3, 2, 1}, 1);
  std::erase_if(bench.tets, [&](const Tet& tet) {
    Vec3 middle = Vec3::Zero();
    for (const int node : tet) middle += bench.X[node] / 4;
    return middle.y() < 1 && middle.x() > 1 && middle.x() < 2;
  });
  const std::array<double, 4> along{0, 1.5, 1.99, 2};
  for (Vec3& X : bench.X) X = Vec3(12 + along[static_cast<std::size_t>(std::lround(X.x()))], 19.99 + X.y(), 1 + X.z());
  const CollisionMesh collision = make_collision_mesh(bench.tets, bench.X, std::vector<double>(bench.tets.size(), 10.0));
  const TetMesh cell = test::kuhn_lattice({1, 1, 1}, 20);
  const CollisionMesh floor = make_collision_mesh(cell.tets, cell.X, std::vector<double>(cell.tets.size(), 1.0));
  const std::vector<Vec3> v(bench.X.size(), Vec3::Zero());
  const RigidMotion stands{.p_WC = Vec3::Constant(10)};
  const std::vector<CollisionBody> bodies{{.mesh = &collision, .x = bench.X, .v = v, .friction = 0.5},
                                          {.mesh = &floor, .x = cell.X, .rigid = stands, .friction = 0.5}};
  double wide = 0, narrow = 0;
  for (const ContactRow& row : detect(input_of(bodies), kOneThread)) (row.point.x() < 13.7 ? wide : narrow) += row.area;
  EXPECT_NEAR(wide, 1.5, 0.05);
  EXPECT_GT(narrow, 0.01);  // its 10 mm reach 13 mm in, and have sides
}

TEST(Detect, PrescribedNodesAndKinematicBodiesEnterWithTheirVelocity) {
  Cube lower(Vec3(0, 0, 0), Vec3(0.5, 0, 0)), upper(Vec3(0, 0.99, 0), Vec3(0, 0, 0));
  lower.fixed.assign(lower.fixed.size(), 1);
  const std::vector<CollisionBody> bodies{lower.soft(), upper.soft()};
  std::vector<ContactRow> rows = detect(input_of(bodies), kOneThread);
  ASSERT_FALSE(rows.empty());
  for (const ContactRow& row : rows) {
    EXPECT_EQ(row.sides[0].node_count, 0);
    EXPECT_LT((row.known_velocity - Vec3(0.5, 0, 0)).norm(), 1e-14);
    EXPECT_NEAR(row.c_n, 100 * 1000 * row.area, 1e-6 * row.c_n);  // all of the free body's mass
  }
  const RigidMotion turning{Vec3(0.5, 0.5, 0.5), Vec3(0, 0, 0), Vec3(0, 2, 0), 1, false};
  const std::vector<CollisionBody> kinematic{lower.rigid(turning), upper.soft()};
  rows = detect(input_of(kinematic), kOneThread);
  ASSERT_FALSE(rows.empty());
  for (const ContactRow& row : rows)
    EXPECT_LT((row.known_velocity - turning.w.cross(row.point - turning.p_WC)).norm(), 1e-14);
}

TEST(Detect, RigidBodiesMeetSoftOnesOnly) {
  const Cube a(Vec3(0, 0, 0), Vec3::Zero()), b(Vec3(0, 0.9, 0), Vec3::Zero()), c(Vec3(0.9, 0, 0), Vec3::Zero());
  const RigidMotion motion{Vec3::Constant(0.5), Vec3::Zero(), Vec3::Zero(), 250, true};
  const std::vector<CollisionBody> bodies{a.rigid(motion), b.rigid(motion), c.soft()};
  const std::vector<CollisionPlane> planes{{}};
  for (const ContactRow& row : detect(input_of(bodies, planes), kOneThread)) {
    EXPECT_TRUE(row.sides[0].body == 2 || row.sides[1].body == 2);
    if (row.sides[0].body != 0) continue;
    EXPECT_TRUE(row.sides[0].rigid);
    const Vec3 fallen(0, -9.81 / 3600, 0);  // contact is looked for at the end of the step
    EXPECT_LT((row.sides[0].arm - (row.point - fallen - Vec3::Constant(0.5))).norm(), 1e-14);
  }
}

// At 30 m/s a body is half a metre on when contact is found; an arm to where it was would turn it.
TEST(Detect, TheArmOfAFastBodyReachesIntoIt) {
  const Cube cube(Vec3(0, 0.001, 0), Vec3::Zero());
  const RigidMotion motion{.p_WC = Vec3(0.5, 0.501, 0.5), .v = Vec3(30, -1, 0), .mass = 1000, .in_solve = true};
  const std::vector<CollisionPlane> planes{{}};
  const std::vector<CollisionBody> bodies{cube.rigid(motion)};
  const std::vector<ContactRow> rows = detect(input_of(bodies, planes), kOneThread);
  EXPECT_EQ(rows.size(), 9u);
  Vec3 sum = Vec3::Zero();
  for (const ContactRow& row : rows) {
    EXPECT_TRUE(row.sides[0].rigid);
    EXPECT_EQ(row.sides[0].node_count, 0);
    EXPECT_LE(row.sides[0].arm.cwiseAbs().maxCoeff(), 0.5 + 1e-12);
    sum += row.area * row.sides[0].arm;
  }
  EXPECT_NEAR(sum.x(), 0, 1e-12);
  EXPECT_NEAR(sum.y(), -0.5, 1e-12);
}

// What else is rigid meets in the rigid room; a fragment is known to nobody but the solve.
TEST(Detect, RigidFragmentsMeetEachOtherAndRigidBodies) {
  const Cube a(Vec3(0, 0, 0), Vec3::Zero()), b(Vec3(0, 0.9, 0), Vec3::Zero()), c(Vec3(0.9, 0, 0), Vec3::Zero());
  const RigidMotion body{.p_WC = Vec3::Constant(0.5), .mass = 250};
  RigidMotion piece = body;
  piece.in_solve = true;
  const std::vector<CollisionBody> bodies{a.rigid(body), b.rigid(piece), c.rigid(piece)};
  bool met[3][3] = {};
  for (const ContactRow& row : detect(input_of(bodies), kOneThread)) met[row.sides[0].body][row.sides[1].body] = true;
  EXPECT_TRUE(met[0][1] && met[0][2] && met[1][2]);
}

TEST(Detect, PartsOfABrokenBodyMeetEachOther) {
  // Two cubes in one mesh: apart they are components, and pressed together they touch; the intact cube does not.
  Cube broken(Vec3::Zero(), Vec3::Zero());
  const int nodes = static_cast<int>(broken.mesh.X.size());
  for (int i = 0; i < nodes; ++i) {
    broken.mesh.X.push_back(broken.mesh.X[i] + Vec3(0, 2, 0));
    broken.x.push_back(broken.x[i] + Vec3(0, 0.95, 0));
  }
  for (int t = 0; t < 48; ++t) {
    Tet tet = broken.mesh.tets[t];
    for (int& node : tet) node += nodes;
    broken.mesh.tets.push_back(tet);
  }
  broken.v.assign(broken.x.size(), Vec3::Zero());
  broken.fixed.assign(broken.x.size(), 0);
  broken.collision = make_collision_mesh(broken.mesh.tets, broken.mesh.X, std::vector<double>(96, 10.0));
  const std::vector<CollisionBody> bodies{broken.soft()};
  const std::vector<ContactRow> rows = detect(input_of(bodies), kOneThread);
  EXPECT_GT(total_area(rows), 0.9);
  for (const ContactRow& row : rows) EXPECT_NE(row.sides[0].tet < 48, row.sides[1].tet < 48);

  const Cube whole(Vec3::Zero(), Vec3::Zero());
  const std::vector<CollisionBody> alone{whole.soft()};
  EXPECT_TRUE(detect(input_of(alone), kOneThread).empty());
}

TEST(Detect, TetsThatShareANodeNeverMeet) {
  // Two cells along an edge, as fracture can leave them, one of them collapsed into the other.
  const TetMesh lattice = test::kuhn_lattice({2, 2, 1}, 1);
  TetMesh mesh = lattice;
  mesh.tets.assign(lattice.tets.begin(), lattice.tets.begin() + 6);
  mesh.tets.insert(mesh.tets.end(), lattice.tets.begin() + 18, lattice.tets.end());
  const CollisionMesh collision = make_collision_mesh(mesh.tets, mesh.X, std::vector<double>(12, 1.0));
  std::vector<Vec3> x = mesh.X, v(x.size(), Vec3::Zero());
  for (Vec3& p : x) p = Vec3(1, 1, 0) + Vec3(p.x() > 1.5 ? -0.5 : p.x() - 1, p.y() > 1.5 ? -0.5 : p.y() - 1, p.z());
  const std::vector<CollisionBody> bodies{{&collision, x, v, {}, std::nullopt, 0.5}};
  for (const ContactRow& row : detect(input_of(bodies), kOneThread)) {
    const Tet &a = mesh.tets[row.sides[0].tet], &b = mesh.tets[row.sides[1].tet];
    for (const int node : a) EXPECT_EQ(std::ranges::count(b, node), 0);
  }
}

TEST(Detect, BitsDoNotDependOnThreads) {
  std::vector<Cube> cubes;
  std::vector<CollisionBody> bodies;
  for (int k = 0; k < 12; ++k)
    cubes.emplace_back(Vec3(0.93 * (k % 3) + 0.01 * k, 0.91 * (k / 6) - 0.02, 0.9 * (k / 3 % 2)), Vec3(0.1 * k, -0.2, 0));
  for (const Cube& cube : cubes) bodies.push_back(cube.soft());
  const std::vector<CollisionPlane> planes{{}, {Vec3(1, 0, 0), 0.05}};
  const std::vector<ContactRow> one = detect(input_of(bodies, planes), kOneThread);
  const std::vector<ContactRow> two = detect(input_of(bodies, planes), ThreadPool(2));
  ASSERT_EQ(one.size(), two.size());
  EXPECT_GT(one.size(), 100u);
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].normal, two[k].normal);
    EXPECT_EQ(one[k].point, two[k].point);
    EXPECT_EQ(one[k].c_n, two[k].c_n);
    EXPECT_EQ(one[k].target, two[k].target);
    EXPECT_EQ(one[k].sides[0].weights, two[k].sides[0].weights);
  }
}

TEST(Detect, ABodyOfNonFinitePositionMeetsNothing) {
  Cube bad(Vec3(0, 0.2, 0), Vec3::Zero());
  const Cube good(Vec3(0, -0.01, 0), Vec3::Zero());
  for (Vec3& p : bad.x) p.y() = std::numeric_limits<double>::quiet_NaN();
  const std::vector<CollisionBody> bodies{bad.soft(), good.soft()};
  const std::vector<CollisionPlane> planes{{}};
  const std::vector<ContactRow> rows = detect(input_of(bodies, planes), kOneThread);
  EXPECT_FALSE(rows.empty());
  for (const ContactRow& row : rows) EXPECT_EQ(row.sides[0].body, 1);
}

}  // namespace
}  // namespace crumple::sim::contact
