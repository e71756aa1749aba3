#include "common/channel_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple {
namespace {

TEST(ChannelValues, SumOverTheChannelsOfEachVertex) {
  const std::vector<float> values{0.5f, 0, 0.25f, 0.125f, 0.5f, 0};  // two channels of three vertices
  EXPECT_THAT(sum_of_channels(values, 3), testing::ElementsAre(0.625f, 0.5f, 0.25f));
  EXPECT_EQ(sum_of_channels(values, 6), values);
  EXPECT_TRUE(sum_of_channels({}, 3).empty());
}

}  // namespace
}  // namespace crumple
