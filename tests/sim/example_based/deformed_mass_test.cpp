#include "server/sim/example_based/deformed_mass.h"

#include "tests/sim/example_based/bar_fixture.h"

#include <Eigen/Eigenvalues>

namespace crumple::sim::example_based {
namespace {

ExampleRest box() { return make_rest(make_set(bar_mesh({2, 3, 4}, 0.25), {Vec3::Zero()}, {})); }

Mat3 box_inertia(double m, const Vec3& size) {
  const Vec3 s = size.cwiseAbs2();
  return (m / 12 * Vec3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y())).asDiagonal();
}

TEST(DeformedMass, OfABoxIsTheClosedForm) {
  const ExampleRest rest = box();
  EXPECT_NEAR(rest.volume, 0.5 * 0.75 * 1.0, 1e-12);
  std::vector<Vec3> x = rest.x_rest;
  for (Vec3& p : x) p += Vec3(10, -20, 30);
  const DeformedMass mass = deformed_mass(rest, x, 60);
  EXPECT_EQ(mass.mass, 60);
  EXPECT_LT((mass.com - Vec3(10, -20, 30)).norm(), 1e-12);
  EXPECT_LT((mass.inertia - box_inertia(60, Vec3(0.5, 0.75, 1))).norm(), 1e-11);
}

TEST(DeformedMass, TurnsWithTheBodyAndShrinksWithItsSquare) {  // FORMULAS F11: uniform shrink 0.8 -> I x 0.64
  const ExampleRest rest = box();
  const Mat3 R = turn(50, Vec3(1, 2, 3)).q.toRotationMatrix();
  std::vector<Vec3> x = rest.x_rest;
  for (Vec3& p : x) p = R * (0.8 * p);
  const Mat3 expected = 0.64 * R * box_inertia(60, Vec3(0.5, 0.75, 1)) * R.transpose();
  EXPECT_LT((deformed_mass(rest, x, 60).inertia - expected).norm(), 1e-12);
}

TEST(DeformedMass, StaysDefiniteWhenTheBodyIsFlatOrInverted) {
  const ExampleRest rest = box();
  std::vector<Vec3> flat = rest.x_rest, mirrored = rest.x_rest;
  for (Vec3& p : flat) p.y() = 0;
  for (Vec3& p : mirrored) p.y() *= -1;
  EXPECT_LT((deformed_mass(rest, flat, 60).inertia - box_inertia(60, Vec3(0.5, 0, 1))).norm(), 1e-12);
  EXPECT_LT((deformed_mass(rest, mirrored, 60).inertia - box_inertia(60, Vec3(0.5, 0.75, 1))).norm(), 1e-12);
  EXPECT_EQ(inverted_tets(rest, rest.x_rest), 0);
  EXPECT_EQ(inverted_tets(rest, mirrored), rest.set->mesh.tet_count());
}

TEST(DeformedMass, LumpingOverestimatesByTheSquareOfTheEdge) {
  double error[2];
  for (int k : {0, 1}) {
    const int n = 4 << k;
    const ExampleRest rest = make_rest(make_set(bar_mesh({n, n, n}, 1.0 / n), {Vec3::Zero()}, {}));
    error[k] =
        lumped_mass(rest, rest.x_rest, 60).inertia.trace() / deformed_mass(rest, rest.x_rest, 60).inertia.trace() - 1;
  }
  EXPECT_GT(error[1], 0);
  EXPECT_NEAR(error[0] / error[1], 4, 0.01);
}

TEST(DeformedMass, FollowsTheFill) {
  auto set = make_set(bar_mesh({1, 1, 2}, 1), {Vec3::Zero()}, {});
  set->mesh.fill.assign(12, 1.0);
  for (int t = 0; t < 6; ++t) set->mesh.fill[t] = 0.5;  // the cell below z = 0
  const ExampleRest rest = make_rest(set);
  EXPECT_NEAR(rest.volume, 1.5, 1e-12);
  EXPECT_LT((deformed_mass(rest, rest.x_rest, 3).com - Vec3(0, 0, (0.5 * 1 - 0.5 * 0.5) / 1.5)).norm(), 1e-12);
}

}  // namespace
}  // namespace crumple::sim::example_based
