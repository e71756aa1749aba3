#include "server/sim/contact/friction.h"

#include <gtest/gtest.h>

namespace crumple::sim::contact {
namespace {

ContactRow a_row() {
  ContactRow row;
  row.normal = Vec3::UnitY();
  row.c_n = 10;
  row.friction = 0.5;
  row.sides[0].body = 1;
  row.sides[0].tet = 7;
  row.sides[1].body = 3;
  return row;
}

TEST(Friction, SticksInsideTheCone) {
  std::vector<ContactRow> rows{a_row()};
  carry_friction({}, rows);
  ContactRow& row = rows[0];
  EXPECT_FALSE(refresh_friction(row, Vec3(0.4, -1, 0), false));  // lambda_n = 10, needs 4 of 5
  EXPECT_TRUE(row.active);
  EXPECT_EQ(row.c_t, row.c_n);
  EXPECT_NEAR(row.lambda_n, 10, 1e-15);
  EXPECT_LT((row.lambda_t - Vec3(-4, 0, 0)).norm(), 1e-15);
}

TEST(Friction, SlidesWithMuTimesTheNormalImpulseAgainstTheMotion) {
  std::vector<ContactRow> rows{a_row()};
  carry_friction({}, rows);
  ContactRow& row = rows[0];
  EXPECT_TRUE(refresh_friction(row, Vec3(0.6, -1, 0.8), false));  // would need 10, may have 5
  EXPECT_EQ(row.c_t, 0);
  EXPECT_LT((row.t0 - 5 * Vec3(-0.6, 0, -0.8)).norm(), 1e-14);
  EXPECT_FALSE(refresh_friction(row, Vec3(0.6, -1, 0.8), false));  // same motion: settled
  set_outcome(row, Vec3(3, -1, 1));
  EXPECT_NEAR(row.lambda_t.norm(), 0.5 * row.lambda_n, 1e-14);
  EXPECT_TRUE(refresh_friction(row, Vec3(0, -2, 0), false));  // pressed harder: holds again
  EXPECT_EQ(row.c_t, row.c_n);
}

TEST(Friction, RowsThatWouldPullLetGoUnlessDampingIsRaw) {
  ContactRow row = a_row();
  EXPECT_TRUE(refresh_friction(row, Vec3(0, 1, 0), false));
  EXPECT_FALSE(row.active);
  set_outcome(row, Vec3(0, 1, 0));
  EXPECT_EQ(row.impulse(), Vec3(0, 0, 0));
  EXPECT_TRUE(refresh_friction(row, Vec3(0, -1, 0), false));
  EXPECT_TRUE(row.active);
  row.friction = 0;
  EXPECT_FALSE(refresh_friction(row, Vec3(0, 1, 0), true));
  EXPECT_TRUE(row.active);
  EXPECT_NEAR(row.lambda_n, -10, 1e-14);
}

TEST(Friction, CarriesLastStepsImpulseIntoTheSameContact) {
  ContactRow held = a_row();
  held.lambda_t = Vec3(1, 0, 2);
  ContactRow other = a_row();
  other.sides[0].tet = 9;
  other.lambda_t = Vec3(5, 0, 0);
  ContactRow open = a_row();
  open.active = false;
  open.sides[0].tet = 8;
  FrictionMemory memory;
  remember_friction(std::vector{other, open}, memory);
  remember_friction(std::vector{held}, memory);
  sort(memory);
  ASSERT_EQ(memory.entries.size(), 2u);

  ContactRow tilted = a_row();
  tilted.normal = Vec3(1, 1, 0).normalized();
  ContactRow unknown = a_row();
  unknown.sides[0].tet = 8;
  std::vector<ContactRow> rows{a_row(), tilted, unknown};
  carry_friction(memory, rows);
  EXPECT_EQ(rows[0].t0, Vec3(1, 0, 2));
  EXPECT_LT((rows[1].t0 - Vec3(0.5, -0.5, 2)).norm(), 1e-15);  // the part in the row's plane
  EXPECT_EQ(rows[2].t0, Vec3(0, 0, 0));
}

}  // namespace
}  // namespace crumple::sim::contact
