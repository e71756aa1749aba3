#include "server/sim/example_based/fatigue.h"

#include "server/sim/example_based/deform.h"
#include "tests/sim/example_based/bar_fixture.h"

#include <cmath>

namespace crumple::sim::example_based {
namespace {

constexpr double kMass = 500;  // [kg]
constexpr double kBeta = 100;  // [N s]

struct Body {
  ExampleRest rest = make_rest(car());
  ExampleParameters p;
  ExampleState state;
  ExampleWorkspace work;

  explicit Body(double fatigue_time) {
    p.beta = kBeta;
    p.fatigue_time = fatigue_time;
    state = make_state(rest, p);
  }
  // |j| [N s] on vertex 5, or none.
  bool dents(double dt, double j) {
    const std::vector<VertexImpulse> blow{{5, Vec3(0, 0, -j)}};
    return !deform(rest, p, {.dt = dt, .rate_dt = 0.004}, kMass, j > 0 ? std::span(blow) : std::span<VertexImpulse>(), ThreadPool(1), state, work)
                .plastic.empty();
  }
  double dented() const { return (1 - state.E.col(0).array()).sum(); }
};

// Blows of 40 N s every half second, remembered for 2 s: the sum of 40 e^(-k / 4) passes 100 with the fourth.
TEST(Fatigue, SmallBlowsDentFromTheOneOnThatTheFormulaSays) {
  const double blow = 40, interval = 0.5, memory = 2;
  int expected = 1;
  for (double sum = blow; sum <= kBeta; ++expected) sum = sum * std::exp(-interval / memory) + blow;
  ASSERT_EQ(expected, 4);
  for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240}) {
    const int steps = static_cast<int>(std::lround(interval / dt));
    Body body(memory), forgetful(0);
    int first = 0;
    for (int n = 1; n <= 10; ++n) {
      EXPECT_FALSE(forgetful.dents(dt, blow)) << "without memory none does";
      if (body.dents(dt, blow) && first == 0) first = n;
      for (int k = 1; k < steps; ++k) EXPECT_FALSE(body.dents(dt, 0));
    }
    EXPECT_EQ(first, expected) << dt;
    EXPECT_EQ(forgetful.dented(), 0);
    EXPECT_GT(body.dented(), 0.01);
  }
}

TEST(Fatigue, BlowsThatAreForgottenInTimeNeverDent) {
  Body body(0.2);  // the sum of 40 e^(-k / 0.4) stays below 44
  for (int n = 0; n < 40; ++n) {
    EXPECT_FALSE(body.dents(0.05, 40));
    for (int k = 1; k < 10; ++k) body.dents(0.05, 0);
  }
}

TEST(Fatigue, BlowsFromOppositeSidesUndoEachOther) {
  Body body(10);
  for (int n = 0; n < 50; ++n) {
    const std::vector<VertexImpulse> blow{{5, Vec3(0, 0, n % 2 ? 60 : -60)}};
    EXPECT_TRUE(deform(body.rest, body.p, {}, kMass, blow, ThreadPool(1), body.state, body.work).plastic.empty());
  }
}

TEST(Fatigue, ALoadThatLastsCreepsAboveBetaOverItsTimeAtAnyStep) {
  const double memory = 0.5, limit = kBeta / memory;  // [N]
  for (const double share : {0.9, 1.5}) {
    std::vector<double> dented;
    for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240}) {
      Body body(memory);
      const int steps = static_cast<int>(std::lround(6 / dt));
      for (int k = 0; k < steps; ++k) body.dents(dt, share * limit * dt);
      EXPECT_EQ(body.work.report.creeps, share > 1) << "a body that will dent is not at rest";
      dented.push_back(body.dented());
    }
    std::printf("load of %.1f beta / time for 6 s: dented %.4f, %.4f, %.4f at dt = 1/60, 1/120, 1/240\n", share, dented[0], dented[1], dented[2]);
    if (share < 1) {
      EXPECT_EQ(dented, (std::vector<double>{0, 0, 0}));
    } else {
      ASSERT_GT(dented[2], 0.1);
      EXPECT_NEAR(dented[0], dented[2], 0.03 * dented[2]);
      EXPECT_NEAR(dented[1], dented[2], 0.02 * dented[2]);
    }
  }
}

TEST(Fatigue, ForgetsWhatHasFadedAndWhatIsNotFinite) {
  Body body(0.1);
  body.dents(0.01, 50);
  const std::vector<VertexImpulse> bad{{6, Vec3(0, NAN, 0)}};
  EXPECT_EQ(deform(body.rest, body.p, {}, kMass, bad, ThreadPool(1), body.state, body.work).rejected, 1);
  ASSERT_EQ(body.state.fatigue.size(), 1u);
  EXPECT_EQ(body.state.fatigue[0].vertex, 5);
  for (int k = 0; k < 200; ++k) body.dents(0.01, 0);
  EXPECT_TRUE(body.state.fatigue.empty());
}

}  // namespace
}  // namespace crumple::sim::example_based
