#include "tests/lab/stability/row_outcomes.h"

#include "server/lab/stability/contact_trial.h"

// Why contact is implicit rows with depth recovery.
namespace crumple::lab::stability {
namespace {

TEST(StabilityContact, RawDampingSinksForEverRecoveryDoesNot) {
  const Outcome raw = outcome_of(21, "raw-1e6");
  EXPECT_EQ(raw.verdict, Verdict::limit) << raw.text;
  EXPECT_NEAR(raw.value, 9.81e-3, 0.02 * 9.81e-3);  // m g / (phi A)
  expect_verdict(21, "recovery", Verdict::pass);
}

TEST(StabilityContact, RawDampingNeverPartsAnOverlapRecoveryDoes) {
  EXPECT_NE(outcome_of(19, "raw-1e6").text.find("stay overlapped"), std::string::npos);
  const Outcome recovery = outcome_of(19, "recovery");
  EXPECT_EQ(recovery.verdict, Verdict::pass) << recovery.text;
  EXPECT_NE(recovery.text.find("the cubes part"), std::string::npos);
}

TEST(StabilityContact, PenaltySpringsThrowAnOverlapApart) {
  EXPECT_GT(outcome_of(19, "penalty").value, 2);
  EXPECT_NE(outcome_of(19, "penalty").verdict, Verdict::pass);
}

TEST(StabilityContact, SweptRigidBodiesDoNotTunnel) { expect_verdict(18, "rigid", Verdict::pass); }

TEST(StabilityContact, ASlowShotStopsInFrontOfAThickPlate) {
  for (const char* method : {"recovery", "raw-1e9", "rigid"}) {
    const Shot shot = shot_at_plate(find_method(method)->contact, Vec3::Constant(0.3), 1, 0.3, 1.0 / 60, 0.4);
    EXPECT_TRUE(shot.sound) << method;
    EXPECT_FALSE(shot.behind) << method;
    EXPECT_LT(shot.penetration, 0.03) << method;
  }
}

TEST(StabilityContact, EqualBlocksStackWithoutOverlap) {
  const HeavyOnLight result = heavy_on_light(find_method("recovery")->contact, 1, 1.0 / 60, 1.5);
  EXPECT_TRUE(result.sound);
  EXPECT_FALSE(result.fell);
  EXPECT_LT(result.penetration, 0.01);
}

}  // namespace
}  // namespace crumple::lab::stability
