#include "server/sim/guard/island_guard.h"

#include <gtest/gtest.h>

#include <vector>

namespace crumple::sim::guard {
namespace {

Measurement calm() { return {.energy = 100, .mass = 10}; }

// Findings of `steps` equal steps.
std::vector<Finding> run(const Measurement& m, int steps, BodyGuard& guard) {
  std::vector<Finding> found;
  for (int k = 0; k < steps; ++k)
    if (const auto finding = watch(m, guard)) found.push_back(*finding);
  return found;
}

TEST(IslandGuard, SaysNothingOfACalmIsland) {
  BodyGuard guard;
  EXPECT_TRUE(run(calm(), 1000, guard).empty());
}

TEST(IslandGuard, SumsSmallGrowthUntilItIsBeyondItsBound) {
  Measurement growing = calm();
  growing.surplus = 0.01 * growing.energy;
  BodyGuard guard;
  int steps = 0;
  for (std::optional<Finding> found; !found && steps < 100; ++steps) {
    found = watch(growing, guard);
    if (!found) continue;
    EXPECT_EQ(found->quantity, Quantity::energy);
    EXPECT_GT(found->value, found->bound);
    EXPECT_DOUBLE_EQ(found->bound, kEnergyPart * growing.energy);
    EXPECT_EQ(found->rung, Rung::more_iterations);
  }
  EXPECT_LE(steps, kPatience + kInARow);
}

TEST(IslandGuard, GrowthThatDissipationTakesBackIsNoGrowth) {
  BodyGuard guard;
  for (int k = 0; k < 1000; ++k) {
    Measurement m = calm();
    m.surplus = (k % 2 == 0 ? 0.03 : -0.03) * m.energy;
    EXPECT_FALSE(watch(m, guard));
  }
}

TEST(IslandGuard, OneJumpIsNoGrowthASecondOneIs) {
  BodyGuard guard;
  Measurement jump = calm();
  jump.surplus = 0.5 * jump.energy;
  EXPECT_FALSE(watch(jump, guard));
  for (int k = 0; k < 8; ++k) EXPECT_FALSE(watch(calm(), guard));
  const std::optional<Finding> found = watch(jump, guard);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->quantity, Quantity::energy);
}

TEST(IslandGuard, ClimbsToTheTopOneRungAtATimeWhereEnergyRunsAway) {
  Measurement exploding = calm();
  BodyGuard guard;
  std::vector<Finding> found;
  for (int k = 0; k < 200; ++k) {
    exploding.surplus = 0.2 * exploding.energy;
    exploding.energy += exploding.surplus;
    if (const auto finding = watch(exploding, guard)) found.push_back(*finding);
  }
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(found[0].rung, Rung::more_iterations);
  EXPECT_EQ(found[1].rung, Rung::safe_rotation);
  EXPECT_EQ(found[2].rung, Rung::sub_steps);
  EXPECT_EQ(found[3].rung, Rung::frozen);
  for (const Finding& f : found) EXPECT_TRUE(f.up);
}

TEST(IslandGuard, EnergyThatGrowsAndComesBackNeverFreezes) {
  BodyGuard guard;
  for (int k = 0; k < 2000; ++k) {
    Measurement m = calm();
    m.surplus = (k / 6 % 2 == 0 ? 0.5 : -0.5) * m.energy;
    watch(m, guard);
  }
  EXPECT_EQ(guard.rung, Rung::sub_steps);
}

TEST(IslandGuard, InvertedTetsAndCappedSolvesNeverFreeze) {
  Measurement inverted = calm(), capped = calm();
  inverted.inverted = 3;
  capped.capped = true;
  capped.residual = 0.2;
  BodyGuard a, b;
  const auto stays = run(inverted, 1000, a), unsolved = run(capped, 1000, b);
  EXPECT_EQ(a.rung, Rung::sub_steps);
  EXPECT_EQ(b.rung, Rung::more_iterations);
  ASSERT_FALSE(stays.empty());
  EXPECT_EQ(stays[0].quantity, Quantity::inverted);
  EXPECT_EQ(stays[0].value, 3);
  ASSERT_FALSE(unsolved.empty());
  EXPECT_EQ(unsolved[0].quantity, Quantity::residual);
  EXPECT_EQ(unsolved[0].value, 0.2);
  EXPECT_EQ(unsolved[0].bound, kResidual);
}

TEST(IslandGuard, InversionThatPassesIsNotReported) {
  BodyGuard guard;
  for (int k = 0; k < 1000; ++k) {
    Measurement m = calm();
    m.inverted = k % kPatience == 0 ? 0 : 5;
    EXPECT_FALSE(watch(m, guard));
  }
}

TEST(IslandGuard, ComesDownAgainWhenItIsCalm) {
  Measurement inverted = calm();
  inverted.inverted = 1;
  BodyGuard guard;
  run(inverted, 3 * kPatience, guard);
  const Rung reached = guard.rung;
  ASSERT_GT(reached, Rung::normal);
  const auto down = run(calm(), 5 * kCalm, guard);
  EXPECT_EQ(down.size(), static_cast<std::size_t>(reached));
  for (const Finding& f : down) EXPECT_FALSE(f.up);
  EXPECT_EQ(guard.rung, Rung::normal);
}

TEST(IslandGuard, FrozenIsForGood) {
  BodyGuard guard{.rung = Rung::frozen};
  EXPECT_TRUE(run(calm(), 1000, guard).empty());
  EXPECT_EQ(guard.rung, Rung::frozen);
}

}  // namespace
}  // namespace crumple::sim::guard
