#include "server/sim/example_based/hull_points.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(HullPoints, OfABoxAreItsCorners) {
  const ExampleRest rest = make_rest(make_set(bar_mesh({3, 4, 5}, 0.3), {Vec3::Zero()}, {}));
  const ExampleState state = make_state(rest, {});
  std::vector<Vec3> points;
  hull_points(rest, state, 0, points);
  ASSERT_EQ(points.size(), 8u);
  for (const Vec3& p : points) EXPECT_LT((p.cwiseAbs() - Vec3(0.45, 0.6, 0.75)).norm(), 1e-12);
}

// By how much the hull of the candidates falls short of that of all vertices, relative to the body's size.
double shortfall(const ExampleRest& rest, const ExampleState& state, std::mt19937& random) {
  std::vector<Vec3> points;
  hull_points(rest, state, 0, points);
  double worst = 0;
  for (int k = 0; k < 100; ++k) {
    const Vec3 n = random_vector(random).normalized();
    double all = -INFINITY, chosen = -INFINITY;
    for (const Vec3& x : state.x) all = std::max(all, n.dot(x));
    for (const Vec3& x : points) chosen = std::max(chosen, n.dot(x));
    worst = std::max(worst, all - chosen);
  }
  return worst / 1.8;
}

TEST(HullPoints, AreFewAndReachAsFarAsTheBody) {
  std::mt19937 random(13);
  const ExampleRest rest = make_rest(car(1, 3));
  EXPECT_EQ(rest.vertex_count(), 2500);
  EXPECT_LE(rest.hull_vertices[0].size(), 120u);
  RecordProperty("hull_vertices", static_cast<int>(rest.hull_vertices[0].size()));
  ExampleState state = make_state(rest, {});
  EXPECT_LT(shortfall(rest, state, random), 1e-3);
  for (int e = 1; e < 4; ++e) {
    for (int i = 0; i < rest.vertex_count(); ++i) state.x[i] = skin_in_example(rest, i, e);
    EXPECT_LT(shortfall(rest, state, random), 0.01) << e;
  }
}

TEST(HullPoints, ReachAsFarAsTheBodyBetweenTheExamples) {
  std::mt19937 random(14);
  ExampleParameters p;
  const ExampleRest rest = make_rest(car(1, 2));
  const ThreadPool pool(1);
  for (int trial = 0; trial < 20; ++trial) {
    ExampleState state = make_state(rest, p);
    ExampleWorkspace work;
    for (int k = 0; k < 60; ++k) {
      const VertexImpulse blow{rest.surface_vertices[random() % rest.surface_vertices.size()],
                               400 * random_vector(random)};
      deform(rest, p, {}, 500, std::span(&blow, k % 15 == 0 ? 1 : 0), pool, state, work);
    }
    EXPECT_LT(shortfall(rest, state, random), 0.02) << trial;
  }
}

TEST(HullPoints, ACylinderKeepsItsRoundness) {
  // 32 vertices on each rim, radius 0.5.
  auto set = make_set(bar_mesh({8, 8, 4}, 0.125), {Vec3::Zero()}, {});
  for (Vec3& X : set->mesh.X) {  // square to disc, ring by ring
    const double ring = std::max(std::abs(X.x()), std::abs(X.y())), radius = std::hypot(X.x(), X.y());
    if (radius > 0) X.head<2>() *= ring / radius;
  }
  ASSERT_TRUE(validate(*set, "set"));
  const ExampleRest rest = make_rest(set);
  std::mt19937 random(15);
  EXPECT_LT(shortfall(rest, make_state(rest, {}), random), 2e-3);
  EXPECT_LT(rest.hull_vertices[0].size(), 100u);
}

}  // namespace
}  // namespace crumple::sim::example_based
