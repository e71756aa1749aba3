#include "server/sim/example_based/application.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

// A body of two examples whose vertex 0 still has `d` to come.
struct OneRow {
  ExampleParameters p;
  ExampleState state;
  ThreadPool pool{1};
  std::vector<int> changed;

  OneRow(double rest, double pose) {
    p.raw_rates = true;
    state = make_state(make_rest(make_set(bar_mesh({1, 1, 1}, 1), {Vec3::Zero()}, {{turn(30, Vec3::UnitX())}})), p);
    state.dE.row(0) << rest, pose;
    state.active = {0};
  }
  void apply(double lambda, int steps) {
    for (int k = 0; k < steps; ++k) apply_delayed(p, lambda, pool, state, changed);
  }
};

TEST(DelayedApplication, AfterNStepsTheGeometricShareIsApplied) {  // FORMULAS F14
  for (double lambda : {0.0, 0.5, 0.9, 0.99})
    for (int n : {1, 2, 10}) {
      OneRow row(-0.3, 0.3);
      row.apply(lambda, n);
      EXPECT_NEAR(row.state.E(0, 1), 0.3 * (1 - std::pow(lambda, n)), 1e-14);
    }
}

TEST(DelayedApplication, TotalDoesNotDependOnLambdaWhereNothingIsClamped) {  // FORMULAS F14, eq. 14
  for (double lambda : {0.0, 0.5, 0.9, 0.99}) {
    OneRow row(-0.3, 0.3);
    row.apply(lambda, 5000);
    EXPECT_NEAR(row.state.E(0, 0), 0.7, 1e-12);
    EXPECT_NEAR(row.state.E(0, 1), 0.3, 1e-12);
  }
}

TEST(DelayedApplication, NormalisingMakesTheTotalDependOnLambda) {  // FORMULAS F14: the paper's claim fails here
  const double lambda[] = {0, 0.5, 0.9, 0.99}, expected[] = {0.4444, 0.5096, 0.5433, 0.5500};
  for (int k = 0; k < 4; ++k) {
    OneRow row(0, 0.8);
    row.apply(lambda[k], 5000);
    EXPECT_NEAR(row.state.E(0, 1), expected[k], 5.1e-5) << lambda[k];
  }
}

TEST(DelayedApplication, NegligibleRowsAreFinishedAndLeft) {
  OneRow row(-0.3, 0.3);
  row.p.raw_rates = false;
  int steps = 0;
  while (!row.state.active.empty() && steps < 1000) {
    row.apply(0.9, 1);
    ++steps;
  }
  // 0.3 * 0.9^n <= 1e-4 at n = 76
  EXPECT_EQ(steps, 76);
  EXPECT_EQ(row.state.dE.norm(), 0);
  EXPECT_NEAR(row.state.E(0, 1), 0.3, 1e-14);  // the rest was applied, not dropped
  row.apply(0.9, 1);
  EXPECT_TRUE(row.changed.empty());
}

TEST(DelayedApplication, RateDoesNotDependOnTheStep) {  // DESIGN decision 7
  ExampleParameters p;
  p.lambda = 0.95;
  EXPECT_DOUBLE_EQ(lambda_per_step(p, 0.004, 0.004), 0.95);
  EXPECT_NEAR(std::pow(lambda_per_step(p, 0.001, 0.004), 4), 0.95, 1e-15);
  EXPECT_NEAR(lambda_per_step(p, 0.008, 0.004), 0.95 * 0.95, 1e-15);
  p.lambda = 0;
  EXPECT_EQ(lambda_per_step(p, 0.001, 0.004), 0);
  p.raw_rates = true;
  p.lambda = 0.95;
  EXPECT_EQ(lambda_per_step(p, 0.001, 0.004), 0.95);
}

TEST(DelayedApplication, RowsStayInTheSimplexForHundredThousandUpdates) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> size(-8, 3);
  ExampleParameters p;
  ExampleState state = make_state(make_rest(car()), p);
  const ThreadPool pool(1);
  std::vector<int> changed;
  for (int update = 0; update < 100000; ++update) {
    state.active = {0, 1, 2, 3};
    const double scale = std::pow(10.0, size(random));
    for (int i : state.active)
      for (int e = 0; e < 4; ++e) state.dE(i, e) += scale * (random() / 2147483648.0 - 1);
    if (update % 5000 == 0) state.dE.row(2).setConstant(-1e6);  // nothing positive is left: the rest pose
    apply_delayed(p, 0.5, pool, state, changed);
    ASSERT_LT(simplex_error(state.E), 1e-12) << update;
    if (update % 5000 == 0) {
      ASSERT_EQ(state.E(2, 0), 1);
    }
  }
}

}  // namespace
}  // namespace crumple::sim::example_based
