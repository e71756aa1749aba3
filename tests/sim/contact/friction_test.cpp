#include "server/sim/contact/friction.h"

#include <gtest/gtest.h>

namespace crumple::sim::contact {
namespace {

ContactRow a_row() {
  ContactRow row;
  row.normal = Vec3::UnitY();
  row.c_n = 10;
  row.mass = 0.1;
  row.friction = 0.5;
  row.sides[0].body = 1;
  row.sides[0].tet = 7;
  row.sides[1].body = 3;
  return row;
}

ContactRow started(const Vec3& u, const FrictionMemory& memory = {}) {
  ContactRow row = a_row();
  start_row(memory, u, false, row);
  return row;
}

bool refresh_row(ContactRow& row, const Vec3& u, bool may_pull) {
  return refresh_rows(std::span(&row, 1), std::span(&u, 1), may_pull);
}

TEST(Friction, SticksInsideTheCone) {
  ContactRow row = started(Vec3(0, -1, 0));
  EXPECT_FALSE(refresh_row(row, Vec3(0.4, -1, 0), false));  // lambda_n = 10, needs 4 of 5
  EXPECT_TRUE(row.active);
  EXPECT_EQ(row.c_t, row.c_n);
  set_outcome(row, Vec3(0.4, -1, 0));
  EXPECT_NEAR(row.lambda_n, 10, 1e-15);
  EXPECT_LT((row.lambda_t - Vec3(-4, 0, 0)).norm(), 1e-15);
}

TEST(Friction, RowThatHeldTooMuchLetsGoAtTheSpeedThatTheExcessGivesItsMass) {
  ContactRow row = started(Vec3(0, -1, 0));
  EXPECT_TRUE(refresh_row(row, Vec3(0.6, -1, 0.8), false));  // held 10, may hold 5: 5 N s into 0.1 kg
  EXPECT_NEAR(row.c_t, 5 / (1 + 5 / 0.1), 1e-14);
  EXPECT_EQ(row.t0, Vec3(0, 0, 0));
}

TEST(Friction, SlidingRowHoldsMuTimesTheNormalImpulseAgainstTheMotion) {
  ContactRow row = started(Vec3(3, -1, 4));  // new and moving: the first pass is free of friction
  EXPECT_EQ(row.c_t, 0);
  const Vec3 u(3, -1, 4);
  row.mass = 1e6;  // so heavy that friction does not change its speed
  for (int pass = 0; pass < 3; ++pass) refresh_row(row, u, false);
  set_outcome(row, u);
  EXPECT_LT((row.lambda_t - 0.5 * row.lambda_n * Vec3(-0.6, 0, -0.8)).norm(), 1e-3);
  EXPECT_FALSE(refresh_row(row, u, false));  // settled
}

TEST(Friction, RowsOfAPairLetGoTogether) {
  std::vector<ContactRow> rows{started(Vec3(0, -1, 0)), started(Vec3(0, -1, 0)), started(Vec3(0, -1, 0))};
  rows[2].pair = 1;
  const std::vector<Vec3> u{Vec3(0.8, -1, 0), Vec3(0.6, -1, 0), Vec3(0.4, -1, 0)};  // hold 8, 6, 4; may hold 5 each
  EXPECT_TRUE(refresh_rows(rows, u, false));
  EXPECT_NEAR(rows[0].c_t, 5 / (0.8 + 4 / 0.2), 1e-14);
  EXPECT_NEAR(rows[1].c_t, 5 / (0.6 + 4 / 0.2), 1e-14);
  EXPECT_EQ(rows[2].c_t, rows[2].c_n);
}

TEST(Friction, RowBeyondItsConeYieldsToOthersThatCanHold) {
  std::vector<ContactRow> rows{started(Vec3(0, -1, 0)), started(Vec3(0, -1, 0))};
  const std::vector<Vec3> u{Vec3(0.6, -1, 0), Vec3(0.3, -1, 0)};  // hold 6 and 3 where both may hold 5
  EXPECT_TRUE(refresh_rows(rows, u, false));
  EXPECT_EQ(rows[0].c_t, rows[0].c_n);
  EXPECT_LT((rows[0].t0 - Vec3(-5, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(rows[1].t0, Vec3(0, 0, 0));
}

TEST(Friction, PullingRowsDoNotAddToWhatTheOthersMayHold) {
  std::vector<ContactRow> rows{started(Vec3(0, -1, 0)), started(Vec3(0, -1, 0))};
  // Press with 30 and pull with 20: together 10, of which friction may hold 5; the row holds 6.
  EXPECT_TRUE(refresh_rows(rows, std::vector<Vec3>{Vec3(0.6, -3, 0), Vec3(0, 2, 0)}, false));
  EXPECT_FALSE(rows[1].active);
  EXPECT_NEAR(rows[0].c_t, 5 / (0.6 + 1 / 0.1), 1e-14);
}

TEST(Friction, SlidingRowThatHasStoppedSticks) {
  ContactRow row = started(Vec3(3, -1, 4));
  EXPECT_TRUE(refresh_row(row, Vec3(1e-3, -1, 0), false));
  EXPECT_EQ(row.c_t, row.c_n);
}

TEST(Friction, OnlyRowsThatPushAreActive) {
  EXPECT_TRUE(started(Vec3(0, -1, 0)).active);
  ContactRow row = started(Vec3(0, 1, 0));
  EXPECT_FALSE(row.active);
  EXPECT_TRUE(refresh_row(row, Vec3(0, -1, 0), false));  // it would push after all
  EXPECT_TRUE(row.active);
  EXPECT_TRUE(refresh_row(row, Vec3(0, 1, 0), false));
  EXPECT_FALSE(row.active);
  set_outcome(row, Vec3(0, 1, 0));
  EXPECT_EQ(row.impulse(), Vec3(0, 0, 0));
}

TEST(Friction, RawDampingResistsParting) {
  ContactRow row = a_row();
  row.friction = 0;
  start_row({}, Vec3(0, 1, 0), true, row);
  EXPECT_TRUE(row.active);
  EXPECT_FALSE(refresh_row(row, Vec3(0, 1, 0), true));
  set_outcome(row, Vec3(0, 1, 0));
  EXPECT_NEAR(row.lambda_n, -10, 1e-14);
}

TEST(Friction, CarriesLastStepsImpulseIntoTheSameContact) {
  ContactRow held = a_row();
  held.c_t = held.c_n;
  held.lambda_n = 10;
  held.lambda_t = Vec3(1, 0, 2);
  ContactRow slid = held;
  slid.sides[0].tet = 9;
  slid.c_t = 2;
  slid.lambda_t = Vec3(6, 0, 8);  // more than the cone allows: cut back to 5
  ContactRow open = a_row();
  open.active = false;
  open.sides[0].tet = 8;
  FrictionMemory memory;
  remember_friction(std::vector{slid, open}, memory);
  remember_friction(std::vector{held}, memory);
  memory.make_index();
  ASSERT_EQ(memory.entries.size(), 2u);

  EXPECT_EQ(started(Vec3(0, -1, 0), memory).t0, Vec3(1, 0, 2));
  EXPECT_EQ(started(Vec3(0, -1, 0), memory).c_t, 10);
  ContactRow tilted = a_row();
  tilted.normal = Vec3(1, 1, 0).normalized();
  start_row(memory, Vec3(-1, -1, 0), false, tilted);
  EXPECT_LT((tilted.t0 - Vec3(0.5, -0.5, 2)).norm(), 1e-15);  // the part in the row's plane
  ContactRow sliding = a_row();
  sliding.sides[0].tet = 9;
  start_row(memory, Vec3(2, -1, 0), false, sliding);
  EXPECT_NEAR(sliding.c_t, 5.0 / 2, 1e-14);
  EXPECT_EQ(sliding.t0, Vec3(0, 0, 0));
}

}  // namespace
}  // namespace crumple::sim::contact
