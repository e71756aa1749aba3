#include "server/sim/contact/self_contact.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>
#include <set>

#include "server/sim/contact/detect.h"
#include "server/sim/contact/tet_overlap.h"
#include "tests/support/u_bar.h"

namespace crumple::sim::contact {
namespace {

const ThreadPool kOneThread(1);
constexpr double kH = 0.1;  // edge of a cell [m]

// A body at rest that meets itself, 1 kg a tet; `x` is free to be moved.
struct Piece {
  TetMesh mesh;
  CollisionMesh collision;
  SelfContact self;
  std::vector<Vec3> x, v;

  explicit Piece(TetMesh of) : mesh(std::move(of)), x(mesh.X), v(mesh.X.size(), Vec3::Zero()) {
    collision = make_collision_mesh(mesh.tets, mesh.X, std::vector<double>(mesh.tets.size(), 1.0));
    self = make_self_contact(collision, mesh.X);
  }
  void move(const std::function<Vec3(const Vec3&)>& to) {
    for (std::size_t n = 0; n < x.size(); ++n) x[n] = to(mesh.X[n]);
  }
  std::vector<ContactRow> rows(const ThreadPool& pool = kOneThread, bool asks = true) const {
    const std::vector<CollisionBody> bodies{{.mesh = &collision, .x = x, .v = v, .self = asks ? &self : nullptr}};
    DetectionInput input;
    input.bodies = bodies;
    input.dt = 1.0 / 60;
    return detect(input, pool);
  }
};

Piece bar() { return Piece(test::kuhn_lattice({24, 3, 3}, kH)); }

// Arms 12 x 2 x 2 cells, 0.6 m apart; the last four cells of the upper one lie 2 cm deep in the lower.
Piece closed_u() {
  Piece u(test::u_bar(12, 2, 6, 2, kH));
  u.move([](const Vec3& X) -> Vec3 {
    const double along = std::clamp((X.x() - 2 * kH) / (8 * kH), 0.0, 1.0);
    return X.y() > 5 * kH ? Vec3(X - Vec3(0, along * (6 * kH + 0.02), 0)) : X;
  });
  return u;
}

bool upper(const Piece& u, int tet) {
  return std::ranges::all_of(u.mesh.tets[tet], [&](int node) { return u.mesh.X[node].y() > 5 * kH; });
}

TEST(SelfContact, APieceAtRestDoesNotMeetItself) {
  EXPECT_TRUE(bar().rows().empty());
  EXPECT_TRUE(Piece(test::u_bar(12, 2, 6, 2, kH)).rows().empty());
}

TEST(SelfContact, APieceAtHalfItsLengthDoesNotMeetItself) {
  for (const Vec3& stretch : {Vec3(0.5, 1, 1), Vec3(1, 0.5, 1), Vec3(0.5, 0.5, 0.5)}) {
    Piece squeezed = bar();
    squeezed.move([&](const Vec3& X) -> Vec3 { return X.cwiseProduct(stretch); });
    EXPECT_TRUE(squeezed.rows().empty());
  }
}

// Nodes jump by up to most of an edge, so that tets turn inside out and lie in their neighbours.
TEST(SelfContact, APieceWhoseTetsLieInTheirNeighboursDoesNotMeetItself) {
  Piece crumpled = bar();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jump(-0.4 * kH, 0.4 * kH);
  crumpled.move([&](const Vec3& X) -> Vec3 { return X.cwiseProduct(Vec3(0.5, 1, 1)) + Vec3(jump(random), jump(random), jump(random)); });
  int inverted = 0;
  for (const Tet& t : crumpled.mesh.tets) {
    const Vec3 o = crumpled.x[t[0]];
    inverted += (crumpled.x[t[1]] - o).cross(crumpled.x[t[2]] - o).dot(crumpled.x[t[3]] - o) < 0;
  }
  EXPECT_GT(inverted, 100);
  EXPECT_TRUE(crumpled.rows().empty());
}

TEST(SelfContact, ABarBentByARightAngleDoesNotMeetItself) {
  Piece bent = bar();
  const double radius = 24 * kH / (std::numbers::pi / 2);  // of the middle
  bent.move([&](const Vec3& X) -> Vec3 {
    const double angle = X.x() / radius, r = radius - (X.y() - 1.5 * kH);
    return {r * std::sin(angle), -r * std::cos(angle), X.z()};
  });
  EXPECT_TRUE(bent.rows().empty());
}

TEST(SelfContact, ArmsThatReachIntoEachOtherMeet) {
  const Piece u = closed_u();
  const std::vector<ContactRow> rows = u.rows();
  ASSERT_GT(rows.size(), 10u);
  EXPECT_NEAR(deepest(rows), 0.02, 1e-6);
  Vec3 r = Vec3::Zero();  // in which the upper arm is pushed [m^2]
  for (const ContactRow& row : rows) {
    EXPECT_EQ(row.sides[0].body, row.sides[1].body);
    EXPECT_NE(upper(u, row.sides[0].tet), upper(u, row.sides[1].tet));
    EXPECT_GT(row.point.x(), 9 * kH);
    r += (upper(u, row.sides[0].tet) ? 1 : -1) * row.area * row.normal;
  }
  EXPECT_NEAR(r.y(), 4 * kH * 2 * kH, 0.1 * r.norm());  // the slab's face; a little of the slope before it is below, too
  EXPECT_TRUE(u.rows(kOneThread, false).empty());
}

// Coefficients that a row multiplies with one impulse: neither momentum nor angular momentum comes of it.
TEST(SelfContact, RowsAreInnerForces) {
  const Piece u = closed_u();
  for (const ContactRow& row : u.rows()) {
    double sum = 0;
    Vec3 moment = Vec3::Zero();
    for (const ContactSide& side : row.sides)
      for (int k = 0; k < side.node_count; ++k) {
        sum += side.weights[k];
        moment += side.weights[k] * u.x[side.nodes[k]];
      }
    EXPECT_NEAR(sum, 0, 1e-12);
    EXPECT_NEAR(moment.norm(), 0, 1e-12);  // [m]
  }
}

TEST(SelfContact, TheRowsOfAPieceShareTheReducedMassOfItsHalves) {
  const Piece u = closed_u();
  const std::vector<ContactRow> rows = u.rows();
  const double M = static_cast<double>(u.mesh.tets.size()), V = M * std::pow(kH, 3) / 6;
  double mass = 0;
  for (const ContactRow& row : rows) {
    mass += row.mass;
    EXPECT_NEAR(row.c_n, 100 * (M / 4) * row.area / std::pow(V / 2, 2.0 / 3), 1e-9 * row.c_n);
  }
  EXPECT_NEAR(mass, M / 4, 1e-9 * M);
}

TEST(SelfContact, RowsOfAPairAreConsecutiveAndNoTwoRowsHaveTheSameTets) {
  const std::vector<ContactRow> rows = closed_u().rows();
  std::set<std::pair<int, int>> tets;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    EXPECT_LT(rows[k].sides[0].tet, rows[k].sides[1].tet);  // the order of a key in the memory of friction
    EXPECT_TRUE(tets.emplace(rows[k].sides[0].tet, rows[k].sides[1].tet).second);
    const int before = k == 0 ? -1 : rows[k - 1].pair;
    EXPECT_TRUE(rows[k].pair == before || rows[k].pair == before + 1);
  }
}

TEST(SelfContact, PatchesLeaveOutNoPair) {
  const Piece u = closed_u();
  std::set<std::pair<int, int>> found, all;
  for (const ContactRow& row : u.rows()) found.emplace(row.sides[0].tet, row.sides[1].tet);
  const int boundary = u.collision.components[0].boundary_end;
  for (int i = 0; i < boundary; ++i)
    for (int j = i + 1; j < boundary; ++j) {
      if (near_at_rest(u.self.balls[i], u.self.balls[j])) continue;
      const auto shape = [&](int k) {
        Mat34 x;
        for (int n = 0; n < 4; ++n) x.col(n) = u.x[u.collision.tets[k].nodes[n]];
        return orient(x);
      };
      const OrientedTet a = shape(i), b = shape(j);
      const TetOverlap common = overlap(a, b);
      const auto &s = u.collision.tets[i], &t = u.collision.tets[j];
      if (common.volume > 0 && contact_normal(common, a, b, s.exterior, t.exterior).from_surface) all.emplace(s.id, t.id);
    }
  EXPECT_EQ(found, all);
}

TEST(SelfContact, BitsDoNotDependOnThreads) {
  const Piece u = closed_u();
  const std::vector<ContactRow> one = u.rows(), two = u.rows(ThreadPool(2));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].normal, two[k].normal);
    EXPECT_EQ(one[k].point, two[k].point);
    EXPECT_EQ(one[k].c_n, two[k].c_n);
    EXPECT_EQ(one[k].pair, two[k].pair);
    EXPECT_EQ(one[k].sides[0].weights, two[k].sides[0].weights);
  }
}

// What this costs: arms one cell apart are near at rest, and go through each other.
TEST(SelfContact, ASlitNarrowerThanItsTetsIsNotSeenClosing) {
  Piece narrow(test::u_bar(12, 2, 1, 2, kH));
  narrow.move([](const Vec3& X) -> Vec3 { return X.y() > 2.5 * kH ? Vec3(X - Vec3(0, 1.2 * kH, 0)) : X; });
  for (const ContactRow& row : narrow.rows())
    EXPECT_GT(std::abs(narrow.mesh.X[narrow.mesh.tets[row.sides[0].tet][0]].x() -
                       narrow.mesh.X[narrow.mesh.tets[row.sides[1].tet][0]].x()), kH);
}

}  // namespace
}  // namespace crumple::sim::contact
