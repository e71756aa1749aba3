#include "tests/lab/stability/row_outcomes.h"

#include "server/lab/stability/example_trial.h"
#include "server/lab/stability/self_intersections.h"

// Why eq. 8, aligned quaternions and relative thresholds.
namespace crumple::lab::stability {
namespace {

TEST(StabilityExamples, UnalignedQlerpJumpsAlignedDoesNot) {
  const Outcome aligned = outcome_of(30, "eq8"), unaligned = outcome_of(30, "eq8-unaligned");
  EXPECT_EQ(aligned.verdict, Verdict::pass) << aligned.text;
  EXPECT_NE(unaligned.verdict, Verdict::pass) << unaligned.text;
  EXPECT_GT(unaligned.value, 0.1);  // a corner moves by decimetres for 0.001 of E
}

TEST(StabilityExamples, ThePseudoInverseAmplifiesEquation8AndTikhonovDoNot) {
  EXPECT_GT(outcome_of(33, "eq9-raw").value, 1e4);
  expect_verdict(33, "eq8", Verdict::pass);
  expect_verdict(33, "eq9", Verdict::pass);
}

TEST(StabilityExamples, TheAbsoluteThresholdDependsOnTheScaleTheRelativeOneDoesNot) {
  expect_verdict(31, "eq8-raw", Verdict::limit);
  expect_verdict(31, "eq8", Verdict::pass);
}

TEST(StabilityExamples, TwinsShareTheirWeight) { expect_verdict(32, "eq8", Verdict::pass); }

TEST(StabilityExamples, BatteredBarStaysInTheSimplexAndComesToRest) {
  ExampleTrial trial(bar_set(usual_poses()), find_method("eq8")->example);
  const Battered result = batter(trial, 30, 40);
  EXPECT_TRUE(result.finite);
  EXPECT_LT(result.simplex_error, 1e-12);
  EXPECT_GT(result.jump, 1e-4);  // it did dent
  EXPECT_LT(result.last_move, 1e-5);
}

TEST(SelfIntersections, AreCrossingTrianglesWithoutACommonCorner) {
  const std::vector<Vec3> x{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, -1}, {0.2, 0.2, 1}, {2, 2, 1}, {0.3, 0.3, 5}};
  EXPECT_EQ(self_intersections(std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}, x), 1);
  EXPECT_EQ(self_intersections(std::vector<Triangle>{{0, 1, 2}, {4, 5, 6}}, x), 0);  // above
  EXPECT_EQ(self_intersections(std::vector<Triangle>{{0, 1, 2}, {0, 3, 4}}, x), 0);  // a common corner
  ExampleTrial trial(bar_set(usual_poses()), find_method("eq8")->example);
  EXPECT_EQ(trial.intersections(), 0);
  for (Vec3& p : trial.state.x)
    if (p.z() < 0) p += Vec3(0.13, 0.07, -4 * p.z());  // one half through the other
  EXPECT_GT(trial.intersections(), 0);
}

TEST(StabilityShapes, ConvexPartsSlideOverTriangleFloorsWithoutBumps) { expect_verdict(37, "convex", Verdict::pass); }
TEST(StabilityShapes, DentsKeepTheAngularMomentum) {
  expect_verdict(38, "convex", Verdict::pass);
  expect_verdict(38, "triangles", Verdict::pass);
}

TEST(StabilityPlasticity, CreepPerUpdateDependsOnTheStepCreepPerSecondDoesNot) {
  expect_verdict(27, "raw-creep", Verdict::limit);
  expect_verdict(27, "creep", Verdict::pass);
}

TEST(StabilityPlasticity, OctahedraFlowAndBreakWithinTheirBounds) {
  expect_verdict(26, "creep-octahedra", Verdict::pass);
  expect_verdict(23, "toughness-octahedra", Verdict::pass);
  expect_verdict(25, "toughness-octahedra", Verdict::pass);
}

TEST(StabilityPlasticity, OnlyThePapersFlowHasGhostMomentsWhateverTheElement) {
  const std::string end = "ghost moment is up to ";
  const auto moment = [&](const char* method) {
    const std::string text = outcome_of(26, method).text;
    return std::stod(text.substr(text.find(end) + end.size()));
  };
  EXPECT_LT(moment("deviatoric"), 1e-12);
  EXPECT_NEAR(moment("creep"), 0.22, 0.05);
  EXPECT_NEAR(moment("creep-octahedra"), 0.21, 0.05);
}

TEST(StabilityWorld, BadInputIsRefusedAndTouchesNobody) { expect_verdict(17, "core", Verdict::pass); }

TEST(StabilityFracture, NoPieceIsTooSmallAndNoLinkIsAJoint) { expect_verdict(24, "core", Verdict::pass); }

}  // namespace
}  // namespace crumple::lab::stability
