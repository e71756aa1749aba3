#include "server/sim/example_based/impulse_site.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

// A bent body, so that the tree's boxes are those of another shape than it was built for.
struct Bent {
  ExampleRest rest = make_rest(car(1, 2));
  ExampleState state = make_state(rest, {});
  Bent() {
    for (int i = 0; i < rest.vertex_count(); ++i) {
      state.E.row(i) << 0.2, 0, 0.5, 0.3;
      state.x[i] = skin_vertex(rest, i, state.E.row(i).transpose());
    }
  }
};

TEST(NearestOnTriangle, AgreesWithASearchOverTheTriangle) {
  std::mt19937 random(11);
  for (int n = 0; n < 100; ++n) {
    Vec3 a = random_vector(random), b = random_vector(random), c = random_vector(random), p = 2 * random_vector(random);
    if (n % 10 == 0) c = a + 0.3 * (b - a);  // degenerate
    if (n % 20 == 0) b = c = a;
    const Vec3 w = nearest_on_triangle(p, a, b, c);
    EXPECT_NEAR(w.sum(), 1, 1e-14);
    EXPECT_GE(w.minCoeff(), 0);
    const double found = (p - w[0] * a - w[1] * b - w[2] * c).norm();
    double best = INFINITY;
    for (int s = 0; s <= 60; ++s)
      for (int t = 0; s + t <= 60; ++t) best = std::min(best, (p - a - s / 60.0 * (b - a) - t / 60.0 * (c - a)).norm());
    EXPECT_LE(found, best + 1e-12);
    EXPECT_GT(found, best - 0.1);
  }
}

TEST(SurfaceTree, FindsWhatLookingAtEverythingFinds) {
  const Bent bent;
  SurfaceTree::Boxes boxes;
  bent.rest.surface_tree.refit(bent.state.x, boxes);
  std::mt19937 random(12);
  for (int n = 0; n < 300; ++n) {
    const Vec3 p = n % 3 ? Vec3(0.6 * random_vector(random)) : bent.state.x[random() % bent.rest.vertex_count()];
    EXPECT_EQ(bent.rest.surface_tree.nearest_vertex(p, bent.state.x, boxes),
              nearest_surface_vertex(bent.rest, bent.state, p));
    double best = INFINITY;
    for (const auto& [a, b, c] : bent.rest.surface) {
      const auto& x = bent.state.x;
      const Vec3 w = nearest_on_triangle(p, x[a], x[b], x[c]);
      best = std::min(best, (p - w[0] * x[a] - w[1] * x[b] - w[2] * x[c]).norm());
    }
    EXPECT_NEAR(std::sqrt(bent.rest.surface_tree.nearest(p, bent.state.x, boxes).distance2), best, 1e-14);
  }
}

TEST(LocateImpulses, OneBlowInSeveralContactPointsIsOneImpulse) {
  const Bent bent;
  SurfaceTree::Boxes boxes;
  std::vector<VertexImpulse> at;
  const int v = bent.rest.surface_vertices[100], w = bent.rest.surface_vertices[7];
  const Vec3 x = bent.state.x[v];
  locate_impulses(bent.rest, bent.state,
                  std::vector<PointImpulse>{{x + Vec3(1e-3, 0, 0), Vec3(1, 0, 0)},
                                            {bent.state.x[w], Vec3(5, 0, 0)},
                                            {x - Vec3(1e-3, 0, 0), Vec3(2, 3, 0)}},
                  Site::nearest_vertex, boxes, at);
  ASSERT_EQ(at.size(), 2u);
  EXPECT_EQ(at[0].vertex, w);
  EXPECT_EQ(at[1].vertex, v);
  EXPECT_EQ(at[1].impulse, Vec3(3, 3, 0));
  EXPECT_EQ(at[1].share, 1);
}

TEST(LocateImpulses, TriangleSharesReproduceThePoint) {
  const Bent bent;
  SurfaceTree::Boxes boxes;
  std::vector<VertexImpulse> at;
  const auto& [a, b, c] = bent.rest.surface[50];
  const auto& x = bent.state.x;
  const Vec3 point = 0.5 * x[a] + 0.2 * x[b] + 0.3 * x[c];
  locate_impulses(bent.rest, bent.state, std::vector<PointImpulse>{{point, Vec3(0, 7, 0)}}, Site::nearest_triangle,
                  boxes, at);
  ASSERT_EQ(at.size(), 3u);
  Vec3 sum = Vec3::Zero();
  double shares = 0;
  for (const VertexImpulse& i : at) {
    sum += i.share * x[i.vertex];
    shares += i.share;
    EXPECT_EQ(i.impulse, Vec3(0, 7, 0));  // whole: the yield threshold sees the blow, not its parts
  }
  EXPECT_LT((sum - point).norm(), 1e-12);
  EXPECT_NEAR(shares, 1, 1e-14);
}

TEST(LocateImpulses, NonFiniteInputIsReportedByDeform) {
  Bent bent;
  SurfaceTree::Boxes boxes;
  std::vector<VertexImpulse> at;
  locate_impulses(bent.rest, bent.state,
                  std::vector<PointImpulse>{{Vec3(NAN, 0, 0), Vec3(1, 0, 0)}, {Vec3::Zero(), Vec3(0, INFINITY, 0)}},
                  Site::nearest_triangle, boxes, at);
  ExampleWorkspace work;
  const ExampleState before = bent.state;
  const DeformReport& report = deform(bent.rest, {}, {}, 100, at, ThreadPool(1), bent.state, work);
  EXPECT_EQ(report.rejected, 2);
  EXPECT_EQ(before.x, bent.state.x);
}

}  // namespace
}  // namespace crumple::sim::example_based
