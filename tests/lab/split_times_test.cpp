#include "server/lab/split_times.h"

#include <gtest/gtest.h>

namespace crumple::lab {
namespace {

TEST(SplitTimes, FollowingASplitCostsLessThanMakingTheLevelsAnew) {
  const auto result = time_splits({.cells = {20, 8, 8}, .splits = 20});
  ASSERT_TRUE(result.has_value()) << result.error().text();
  EXPECT_EQ((*result)["nodes"], 21 * 9 * 9);
  EXPECT_GE((*result)["levels"].get<int>(), 2);
  EXPECT_LT((*result)["followed_us"].get<double>(), (*result)["anew_us"].get<double>());
}

TEST(SplitTimes, RefuseWhatIsOutOfRange) {
  EXPECT_EQ(time_splits({.cells = {1, 4, 4}}).error().field, "cells");
  EXPECT_EQ(time_splits({.splits = 0}).error().field, "splits");
}

}  // namespace
}  // namespace crumple::lab
