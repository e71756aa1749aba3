#include "tests/lab/stability/row_outcomes.h"

#include "server/lab/stability/beam_and_modes.h"

#include <cmath>

// Why the integrator is implicit, and what that costs.
namespace crumple::lab::stability {
namespace {

TEST(StabilityIntegration, ExplicitStepsFailAtGameStepsImplicitOnesDoNot) {
  expect_verdict(8, "explicit", Verdict::fails);
  expect_verdict(8, "svd", Verdict::pass);
  expect_verdict(10, "explicit", Verdict::fails);
  expect_verdict(10, "svd", Verdict::pass);
}

TEST(StabilityIntegration, BackwardEulerDampsByItsFormula) {
  expect_verdict(15, "svd", Verdict::pass);
  expect_verdict(15, "direct", Verdict::pass);
  EXPECT_GT(outcome_of(15, "explicit").value, 0.1);  // hardly damps
}

TEST(StabilityIntegration, CappedSolvesAreReportedAndKeepTheMomentum) {
  const Outcome outcome = outcome_of(12, "svd");
  EXPECT_EQ(outcome.verdict, Verdict::pass) << outcome.text;
  EXPECT_EQ(outcome.text.find("cap 5: 0 capped"), std::string::npos) << outcome.text;
}

TEST(StabilityIntegration, LinearisedStepsMakeSpinOutOfNoneExplicitOnesDoNot) {
  expect_verdict(14, "svd", Verdict::limit);
  EXPECT_LT(outcome_of(14, "explicit").value, 1e-6);
}

// omega of the lowest mode by Rayleigh's quotient of a static answer would be above; of its own shape it is exact.
TEST(StabilityIntegration, FreeModesAreAscendingAndCarryNoMomentum) {
  SoftTrial cube(unit_cube(2), soft_material(), find_method("svd")->fem);
  const auto modes = free_modes(cube, 12);
  for (std::size_t k = 0; k < modes.size(); ++k) {
    Vec3 momentum = Vec3::Zero();
    for (int i = 0; i < cube.mesh.node_count(); ++i)
      momentum += cube.rest.node_mass[i] * modes[k].shape.segment<3>(3 * i);
    EXPECT_LT(momentum.norm(), 1e-9 * cube.rest.mass());
    EXPECT_GE(modes[k].omega, modes[k > 0 ? k - 1 : 0].omega);
  }
}

TEST(StabilityIntegration, LinearTetsLockMoreTheNearerToIncompressible) {
  EXPECT_GT(cantilever_ratio(0.3), 0.4);
  EXPECT_LT(cantilever_ratio(0.3), 1);
  EXPECT_LT(cantilever_ratio(0.49), cantilever_ratio(0.3));
  EXPECT_LT(cantilever_ratio(0.4999), 0.1);
}

}  // namespace
}  // namespace crumple::lab::stability
