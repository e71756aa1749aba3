#include "server/sim/example_based/propagation.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(CubicKernel, HasItsPublishedValues) {  // FORMULAS F12
  EXPECT_DOUBLE_EQ(cubic_kernel(0), 1);
  EXPECT_DOUBLE_EQ(cubic_kernel(0.25), 0.84375);
  EXPECT_DOUBLE_EQ(cubic_kernel(0.5), 0.5);
  EXPECT_DOUBLE_EQ(cubic_kernel(0.75), 0.15625);
  EXPECT_EQ(cubic_kernel(1), 0);
  EXPECT_EQ(cubic_kernel(7), 0);
  constexpr double h = 1e-6;
  EXPECT_NEAR((cubic_kernel(h) - cubic_kernel(0)) / h, 0, 1e-5);
  EXPECT_NEAR((cubic_kernel(1) - cubic_kernel(1 - h)) / h, 0, 1e-5);
  double integral = 0;
  for (int k = 0; k < 10000; ++k) integral += cubic_kernel((k + 0.5) / 10000) / 10000;
  EXPECT_NEAR(integral, 0.5, 1e-9);
}

TEST(Propagation, DoesNotJumpTheGapOfAUShapedBar) {
  // Two arms of 0.2 m, 0.2 m apart, joined at z < 0.2 only; struck at the far end of one.
  const TetMesh bar = carve(test::kuhn_lattice({6, 2, 20}, 0.1),
                            [](const Vec3& c) { return c.z() < 0.2 || c.x() < 0.2 || c.x() > 0.4; });
  const ExampleRest rest = make_rest(make_set(bar, {Vec3::Zero()}, {{turn(0, Vec3::UnitX(), Vec3::UnitX())}}));
  int site = 0;
  for (int i = 0; i < rest.vertex_count(); ++i)
    if ((bar.X[i] - Vec3(0.2, 0.1, 2.0)).norm() < (bar.X[site] - Vec3(0.2, 0.1, 2.0)).norm()) site = i;

  ExampleParameters p;
  p.gamma = 0.8;
  const ThreadPool pool(1);
  PropagationCache cache;
  ExampleState state = make_state(rest, p);
  propagate(rest, p, std::vector<WeightChange>{{site, WeightRow{{-0.1, 0.1}}}}, pool, cache, state.dE, state.active);
  int reached = 0, near_across_the_gap = 0;
  for (int i = 0; i < rest.vertex_count(); ++i) {
    const bool struck_arm = bar.X[i].x() < 0.25;
    if (!struck_arm) {
      EXPECT_EQ(state.dE.row(i).norm(), 0);
      near_across_the_gap += (bar.X[i] - bar.X[site]).norm() < 0.5 * p.gamma;
    }
    reached += state.dE(i, 1) > 0;
  }
  EXPECT_GT(near_across_the_gap, 20);
  EXPECT_GT(reached, 50);
  EXPECT_EQ(static_cast<int>(state.active.size()), reached);
  EXPECT_DOUBLE_EQ(state.dE(site, 1), 0.1);
}

TEST(Propagation, AddsOverlappingImpulsesAndKeepsWhatItSearched) {
  const ExampleRest rest = make_rest(car());
  ExampleParameters p;
  p.gamma = 0.7;
  const ThreadPool pool(1);
  PropagationCache cache;
  GeodesicSearch search;
  const std::vector<WeightChange> changes{
      {5, WeightRow{{0, 0.1, 0, 0}}}, {40, WeightRow{{-0.2, 0, 0.3, 0}}}, {5, WeightRow{{0, 0.01, 0, 0.02}}}};
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(rest.vertex_count(), 4);
  for (const auto& [site, de] : changes)
    for (const Reached& r : search.run(rest.graph, site, 1e9))
      expected.row(r.vertex) += cubic_kernel(r.distance / p.gamma) * de.transpose();
  for (int pass = 0; pass < 2; ++pass) {  // the second time from the cache
    ExampleState state = make_state(rest, p);
    propagate(rest, p, changes, pool, cache, state.dE, state.active);
    EXPECT_LT((state.dE - expected).cwiseAbs().maxCoeff(), 1e-15);
    for (int i = 0; i < rest.vertex_count(); ++i)
      EXPECT_EQ(std::binary_search(state.active.begin(), state.active.end(), i), expected.row(i).norm() > 0);
  }
  // Another radius is another result, not the kept one.
  p.gamma = 0.3;
  ExampleState state = make_state(rest, p);
  propagate(rest, p, changes, pool, cache, state.dE, state.active);
  EXPECT_GT((state.dE - expected).cwiseAbs().maxCoeff(), 1e-2);
}

TEST(Propagation, AccumulatorIsBoundedUnlessRaw) {
  const ExampleRest rest = make_rest(car());
  ExampleParameters p;
  const ThreadPool pool(1);
  PropagationCache cache;
  ExampleState state = make_state(rest, p);
  const std::vector<WeightChange> changes(3, {5, WeightRow{{0, 1000, 0, 0}}});
  propagate(rest, p, changes, pool, cache, state.dE, state.active);
  EXPECT_NEAR(state.dE.rowwise().norm().maxCoeff(), kMaxAccumulated, 1e-12);
  p.raw_rates = true;
  state = make_state(rest, p);
  propagate(rest, p, changes, pool, cache, state.dE, state.active);
  EXPECT_NEAR(state.dE.rowwise().norm().maxCoeff(), 3000, 1e-9);
}

}  // namespace
}  // namespace crumple::sim::example_based
