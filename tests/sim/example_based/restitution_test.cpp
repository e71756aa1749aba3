#include "server/sim/example_based/restitution.h"

#include "tests/sim/example_based/bar_fixture.h"

#include <map>

namespace crumple::sim::example_based {
namespace {

TEST(Restitution, DropsAtTheImpactAndComesBackAsThePublishedSequence) {  // FORMULAS F15
  ExampleParameters p;
  p.raw_rates = true;
  p.restitution = 0.6;
  p.nu = 2;
  p.mu = 0.5;
  p.lambda = 0.9;
  const ExampleRest rest = make_rest(car());
  ExampleState state = make_state(rest, p);
  ExampleWorkspace work;
  const ThreadPool pool(1);
  state.dE.row(0) << -std::sqrt(0.5), std::sqrt(0.5), 0, 0;
  state.active = {0};
  const std::map<int, double> expected{{1, 0.081201}, {2, 0.0832}, {10, 0.0992}, {50, 0.1792}, {100, 0.2792}};
  int back = 0;
  for (int step = 1; step <= 300; ++step) {
    release(rest, p, {.dt = 0.004, .rate_dt = 0.004}, pool, state, work);
    if (const auto at = expected.find(step); at != expected.end()) {
      EXPECT_NEAR(state.restitution, at->second, step == 1 ? 5e-7 : 5e-5) << step;
    }
    EXPECT_EQ(work.report.restitution, state.restitution);
    if (back == 0 && std::abs(state.restitution - 0.6) <= 1e-12) back = step;
  }
  EXPECT_EQ(back, 265);
}

TEST(Restitution, DefaultNormDoesNotDependOnTheVertexCount) {
  // The same field of dE on two meshes of one body: the default converges, the raw norm grows with sqrt(N).
  double norm[2], raw[2];
  for (int k : {0, 1}) {
    ExampleParameters p;
    const ExampleRest rest = make_rest(car(1, 1 + k));
    ExampleState state = make_state(rest, p);
    for (int i = 0; i < rest.vertex_count(); ++i) {
      state.dE(i, 1) = cubic_kernel((rest.x_rest[i] - Vec3(0, 0, 0.8)).norm());
      if (state.dE(i, 1) != 0) state.active.push_back(i);
    }
    norm[k] = accumulator_norm(rest, p, state);
    p.raw_rates = true;
    raw[k] = accumulator_norm(rest, p, state);
    EXPECT_NEAR(raw[k], state.dE.norm(), 1e-12);
  }
  EXPECT_NEAR(norm[1] / norm[0], 1, 0.05);
  EXPECT_GT(raw[1] / raw[0], 2);  // sqrt(N1 / N0) = 2.4
}

TEST(Restitution, DefaultNormIsTheRawOneOnAThousandEqualVertices) {
  ExampleRest rest = make_rest(car());
  const int n = rest.vertex_count();
  rest.vertex_share.assign(n, 1.0 / n);
  ExampleParameters p;
  ExampleState state = make_state(rest, p);
  state.dE.setRandom();
  for (int i = 0; i < n; ++i) state.active.push_back(i);
  EXPECT_NEAR(accumulator_norm(rest, p, state), state.dE.norm() * std::sqrt(1000.0 / n), 1e-10);
}

}  // namespace
}  // namespace crumple::sim::example_based
