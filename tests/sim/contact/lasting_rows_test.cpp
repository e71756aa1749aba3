#include "server/sim/contact/lasting_rows.h"

#include <gtest/gtest.h>

namespace crumple::sim::contact {
namespace {

constexpr double kDt = 0.01;  // [s]
constexpr int kBodies = 3;

// Of tet 5 of body 0 and tet 7 of body 2; pulled while they approached at 2 m/s, from 50 mm apart.
ContactRow pulling() {
  ContactRow row;
  row.depth = -0.05;
  row.target = -5;
  row.c_n = 10;
  row.lambda_n = 10 * (row.target + 2);  // c_n (target - n . u)
  row.area = 0.01;
  row.pair = 4;
  for (int side = 0; side < 2; ++side) {
    row.sides[side].body = 2 * side;
    row.sides[side].tet = 5 + 2 * side;
    row.sides[side].nodes = {0, 1, 2, 3};
    row.sides[side].node_count = 4;
    row.sides[side].weights = {0.25, 0.25, 0.25, 0.25};
    if (side == 1) row.sides[side].weights = {-0.25, -0.25, -0.25, -0.25};
  }
  return row;
}

ContactRow pressing() {
  ContactRow row = pulling();
  row.target = 1;
  row.lambda_n = 10 * (row.target + 2);
  return row;
}

struct Bodies {
  std::vector<Vec3> x = std::vector<Vec3>(4, Vec3::Zero());
  std::vector<char> fixed = std::vector<char>(4, 0);
  std::vector<CollisionBody> all;

  Bodies() : all(kBodies) {
    for (CollisionBody& body : all) body.x = x, body.fixed = fixed;
  }
};

std::vector<ContactRow> gone_on(const ContactRow& last, std::span<const CollisionBody> bodies, std::vector<ContactRow> found = {}) {
  LastingRows memory;
  remember_pushing(std::span(&last, 1), kBodies, kDt, memory);
  RowIndex index;
  append_lasting(memory, bodies, kDt, index, found);
  return found;
}

TEST(LastingRows, RowThatPushedGoesOnWithWhatIsLeftOfItsGap) {
  const Bodies bodies;
  const ContactRow last = pressing();  // 20 of its 50 mm are gone after a step at 2 m/s
  const std::vector<ContactRow> rows = gone_on(last, bodies.all);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_NEAR(rows[0].depth, -0.03, 1e-15);
  EXPECT_NEAR(rows[0].target, -3, 1e-12);
  EXPECT_EQ(rows[0].lasted, 1);
  EXPECT_EQ(rows[0].key(), last.key());
}

// Detection has found no overlap, so there is none to take back.
TEST(LastingRows, TakesBackNoDepth) {
  const Bodies bodies;
  ContactRow last = pressing();
  last.depth = 0.02;
  const std::vector<ContactRow> rows = gone_on(last, bodies.all);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].depth, 0);
  EXPECT_EQ(rows[0].target, 0);
}

TEST(LastingRows, WhatDidNotPushOrIsSweptOrHasNodesThatAreNoUnknownsIsForgotten) {
  const Bodies bodies;
  EXPECT_EQ(gone_on(pressing(), bodies.all).size(), 1u);
  EXPECT_TRUE(gone_on(pulling(), bodies.all).empty());
  ContactRow last = pressing();
  last.active = false;
  EXPECT_TRUE(gone_on(last, bodies.all).empty());
  last = pressing();
  last.swept = true;
  EXPECT_TRUE(gone_on(last, bodies.all).empty());
  last = pressing();
  last.sides[1].node_count = 3;
  EXPECT_TRUE(gone_on(last, bodies.all).empty());
  last = pressing();
  last.sides[1].body = kBodies;  // rigid, or a plane
  EXPECT_TRUE(gone_on(last, bodies.all).empty());
}

TEST(LastingRows, WhatIsFoundAgainIsNotDoubled) {
  const Bodies bodies;
  ContactRow found = pressing();
  found.depth = 0.001;
  std::vector<ContactRow> rows = gone_on(pressing(), bodies.all, {found});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].depth, 0.001);
  EXPECT_EQ(rows[0].lasted, 0);
  found.sides[1].tet = 8;  // elsewhere
  rows = gone_on(pressing(), bodies.all, {found});
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].lasted, 1);
  EXPECT_EQ(rows[1].pair, found.pair + 1);
}

TEST(LastingRows, EndsWhereABodyHasBrokenOrSleepsOrANodeIsHeld) {
  Bodies bodies;
  bodies.all[2].origin = 0;
  EXPECT_TRUE(gone_on(pressing(), bodies.all).empty());
  bodies.all[2].origin = -1;
  bodies.all[0].x = {};
  EXPECT_TRUE(gone_on(pressing(), bodies.all).empty());
  bodies.all[0].x = bodies.x;
  std::vector<char> held(4, 0);
  held[3] = 1;
  bodies.all[0].fixed = held;
  EXPECT_TRUE(gone_on(pressing(), bodies.all).empty());
}

// It is 0.1 m wide.
TEST(LastingRows, EndsWhereItsPointsHaveSlidApart) {
  Bodies bodies;
  std::vector<Vec3> moved(4, Vec3(0.09, 0.5, 0));  // along the normal as far as it likes
  bodies.all[2].x = moved;
  EXPECT_EQ(gone_on(pressing(), bodies.all).size(), 1u);
  moved.assign(4, Vec3(0.08, 0, 0.08));
  EXPECT_TRUE(gone_on(pressing(), bodies.all).empty());
}

TEST(LastingRows, KeepTheirPairs) {
  const Bodies bodies;
  std::vector<ContactRow> last(3, pressing());
  last[1].sides[0].tet = 6;
  last[2].sides[0].tet = 8;
  last[2].pair = 5;
  LastingRows memory;
  remember_pushing(last, kBodies, kDt, memory);
  RowIndex index;
  std::vector<ContactRow> rows;
  append_lasting(memory, bodies.all, kDt, index, rows);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].pair, rows[1].pair);
  EXPECT_NE(rows[1].pair, rows[2].pair);
}

TEST(LastingRows, GoesOnForSomeStepsAlone) {
  const Bodies bodies;
  ContactRow row = pressing();
  for (int step = 0; step < kLastingSteps; ++step) {
    const std::vector<ContactRow> rows = gone_on(row, bodies.all);
    ASSERT_EQ(rows.size(), 1u) << step;
    row = rows[0];
    row.lambda_n = 1;
  }
  EXPECT_TRUE(gone_on(row, bodies.all).empty());
}

}  // namespace
}  // namespace crumple::sim::contact
