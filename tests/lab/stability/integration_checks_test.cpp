#include "tests/lab/stability/row_outcomes.h"

#include "server/lab/stability/beam_and_modes.h"
#include "server/lab/stability/newton_statics.h"

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
  expect_verdict(15, "octahedra", Verdict::pass);
  EXPECT_GT(outcome_of(15, "explicit").value, 0.1);  // hardly damps
  EXPECT_LT(outcome_of(15, "direct").value, 1e-6);   // a second of S12's swing is its modes', too
}

// S04's own corotational solution on this mesh, by an independent code (case.json: own_corot_c3d4_L0).
TEST(StabilityIntegration, StaticNewtonWithTheExactTangentFindsTheElasticasEquilibrium) {
  const auto beam = elastica(find_method("svd")->fem, 1);
  const NewtonRun exact = newton(*beam, sim::fem::Tangent::exact);
  ASSERT_TRUE(exact.converged) << exact.residual;
  for (int i = 0; i < beam->mesh.node_count(); ++i)
    if ((beam->mesh.X[i] - Vec3(1, 0.05, 0.05)).norm() < 1e-9)
      EXPECT_LT((exact.x[i] - beam->mesh.X[i] - Vec3(-0.06681304, 0.04041490, -0.32678881)).norm(), 1e-6);
  // Without dR in the tangent: slower at that load, nowhere at ten times it.
  const NewtonRun frozen = newton(*beam, sim::fem::Tangent::fixed_rotation);
  EXPECT_GT(frozen.iterations, 2 * exact.iterations);
  EXPECT_FALSE(newton(*elastica(find_method("svd")->fem, 10), sim::fem::Tangent::fixed_rotation).converged);
  EXPECT_TRUE(newton(*elastica(find_method("svd")->fem, 10), sim::fem::Tangent::exact).converged);
}

TEST(StabilityIntegration, SolvesStartFromTheLastVelocity) {
  EXPECT_NE(outcome_of(12, "svd").text.find("free flight takes 0 iterations"), std::string::npos);
}

// One system, three solvers: what differs is what the tolerance leaves.
TEST(StabilityIntegration, MultigridAndDirectStepsAreTheSameStep) {
  const auto tight = [](sim::fem::FemMaterial& m) { m.cg_tolerance = 1e-10; };
  std::vector<std::vector<Vec3>> ends;
  for (const char* key : {"svd", "svd-multigrid", "direct"}) {
    FemMethod method = find_method(key)->fem;
    method.choose = tight;
    SoftTrial trial(unit_cube(3), soft_material(), method);
    Random random(3);
    trial.deform([&](const Vec3& X) -> Vec3 { return X + random.vec3(-0.1, 0.1); });
    trial.prescribed = {{0, Vec3(0.1, 0, 0)}, {5, Vec3::Zero()}};
    for (const auto& node : trial.prescribed) trial.state.v[node.node] = node.velocity;
    trial.force.setConstant(3);
    trial.run(0.2, 1.0 / 60);
    ends.push_back(trial.state.x);
  }
  for (std::size_t i = 0; i < ends[0].size(); ++i) {
    EXPECT_LT((ends[1][i] - ends[0][i]).norm(), 1e-8) << i;
    EXPECT_LT((ends[2][i] - ends[0][i]).norm(), 1e-8) << i;
  }
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

TEST(StabilityIntegration, LinearTetsLockMoreTheNearerToIncompressibleAndOctahedraLess) {
  const FemMethod& tets = find_method("svd")->fem;
  EXPECT_GT(cantilever_ratio(tets, 0.3), 0.4);
  EXPECT_LT(cantilever_ratio(tets, 0.3), 1);
  EXPECT_LT(cantilever_ratio(tets, 0.49), cantilever_ratio(tets, 0.3));
  EXPECT_LT(cantilever_ratio(tets, 0.4999), 0.1);
  const FemMethod& octahedra = find_method("octahedra")->fem;
  EXPECT_GT(cantilever_ratio(octahedra, 0.3), 0.85);
  EXPECT_GT(cantilever_ratio(octahedra, 0.49), 0.5);
  const FemMethod& hexahedra = find_method("hexahedra")->fem;
  for (const double nu : {0.3, 0.49}) EXPECT_GT(cantilever_ratio(hexahedra, nu), 0.93) << nu;
  for (const double nu : {0.3, 0.49, 0.4999}) EXPECT_NEAR(cook_ratio(hexahedra, nu, 8), 1, 0.04) << nu;
  EXPECT_GT(cook_ratio(octahedra, 0.3, 8), cook_ratio(tets, 0.3, 8));
}

}  // namespace
}  // namespace crumple::lab::stability
