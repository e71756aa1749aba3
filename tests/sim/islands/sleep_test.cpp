#include "server/sim/islands/sleep.h"

#include <gtest/gtest.h>

namespace crumple::sim::islands {
namespace {

constexpr int kMemory = 3;
using Bodies = std::vector<int>;

SleepingIslands live(int count) { return SleepingIslands(std::vector<Activity>(count, Activity::live)); }

TEST(SleepingIslands, ABodyThatIsStillSleepsAndTheOthersDoNot) {
  SleepingIslands islands = live(3);
  EXPECT_EQ(islands.settle(std::vector<char>{0, 1, 0}, kMemory), Bodies{1});
  EXPECT_EQ(islands.activity(1), Activity::asleep);
  EXPECT_EQ(islands.activity(0), Activity::live);
  EXPECT_TRUE(islands.any_asleep());
}

TEST(SleepingIslands, BodiesThatTouchWaitForTheLastOfThem) {
  SleepingIslands islands = live(4);
  islands.touch(0, 1);
  islands.touch(2, 1);
  EXPECT_EQ(islands.settle(std::vector<char>{1, 1, 0, 1}, kMemory), Bodies{3});
  islands.touch(0, 1);
  islands.touch(1, 2);
  EXPECT_EQ(islands.settle(std::vector<char>{1, 1, 1, 1}, kMemory), (Bodies{0, 1, 2}));
}

TEST(SleepingIslands, AnIslandWakesAsAWholeAndNoOther) {
  SleepingIslands islands = live(5);
  islands.touch(0, 1);
  islands.touch(1, 4);
  islands.touch(2, 3);
  EXPECT_EQ(islands.settle(std::vector<char>(5, 1), kMemory).size(), 5u);
  EXPECT_EQ(islands.wake(4), (Bodies{0, 1, 4}));
  EXPECT_EQ(islands.wake(4), Bodies{});
  EXPECT_EQ(islands.activity(2), Activity::asleep);
  EXPECT_EQ(islands.activity(3), Activity::asleep);
}

TEST(SleepingIslands, ContactLostForAStepIsRememberedForAWhile) {
  SleepingIslands islands = live(2);
  const std::vector<char> first_still{1, 0};
  islands.touch(0, 1);
  for (int k = 0; k <= kMemory; ++k) EXPECT_EQ(islands.settle(first_still, kMemory), Bodies{}) << k;
  EXPECT_EQ(islands.settle(first_still, kMemory), Bodies{0});  // too long ago
  EXPECT_FALSE(islands.touched(0, 1));
}

TEST(SleepingIslands, SleepersForgetNothing) {
  SleepingIslands islands = live(3);
  islands.touch(0, 1);
  islands.settle(std::vector<char>{1, 1, 0}, kMemory);
  for (int k = 0; k < 20 * kMemory; ++k) islands.settle(std::vector<char>{0, 0, 0}, kMemory);
  EXPECT_TRUE(islands.touched(1, 0));
  EXPECT_EQ(islands.wake(0), (Bodies{0, 1}));
}

TEST(SleepingIslands, AScriptedBodyJoinsNothingAndWakesWhatTouchedIt) {
  SleepingIslands islands({Activity::live, Activity::kinematic, Activity::live, Activity::live});
  islands.touch(0, 1);
  islands.touch(2, 1);
  EXPECT_EQ(islands.settle(std::vector<char>{1, 0, 0, 1}, kMemory), (Bodies{0, 3}));
  islands.touch(2, 1);
  EXPECT_EQ(islands.settle(std::vector<char>{0, 0, 1, 0}, kMemory), Bodies{2});
  EXPECT_EQ(islands.wake(0), Bodies{0});
  islands.settle(std::vector<char>{1, 0, 0, 0}, kMemory);
  EXPECT_EQ(islands.wake_neighbours(1), (Bodies{0, 2}));
  EXPECT_EQ(islands.activity(3), Activity::asleep);
}

TEST(SleepingIslands, WhatIsHeldNeitherSleepsNorWakes) {
  SleepingIslands islands = live(2);
  islands.settle(std::vector<char>{1, 1}, kMemory);
  islands.set_kinematic(0);
  EXPECT_EQ(islands.wake(0), Bodies{});
  EXPECT_TRUE(islands.any_asleep());
  islands.wake(1);
  EXPECT_FALSE(islands.any_asleep());
}

TEST(SleepingIslands, TheHashSeesStatesAndContacts) {
  const auto hash = [](const SleepingIslands& islands) {
    StateHash hash;
    islands.hash(hash);
    return hash.value();
  };
  SleepingIslands a = live(2), b = live(2);
  EXPECT_EQ(hash(a), hash(b));
  b.touch(0, 1);
  b.settle(std::vector<char>{0, 0}, kMemory);
  EXPECT_NE(hash(a), hash(b));
  SleepingIslands c = live(2);
  c.put_to_sleep(1);
  EXPECT_NE(hash(a), hash(c));
}

}  // namespace
}  // namespace crumple::sim::islands
