#include "server/lab/example_kernels.h"

#include <gtest/gtest.h>

namespace crumple::lab {
namespace {

TEST(ExampleKernels, TimeWhatTheySay) {
  const auto result = time_example_kernels({.cell_size = 0.4, .repeats = 5});
  ASSERT_TRUE(result.has_value()) << result.error().text();
  EXPECT_EQ((*result)["handles"], 32);
  EXPECT_EQ((*result)["examples"], 6);
  EXPECT_GT((*result)["skinning_us"].get<double>(), 0);
  const auto reached = [&](const char* gamma) { return (*result)["impulse_us"][gamma]["vertices_reached"].get<double>(); };
  EXPECT_GT(reached("0.5"), 1);
  EXPECT_GT(reached("3.33"), 5 * reached("0.5"));
  EXPECT_LE(reached("3.33"), (*result)["vertices"].get<double>());
}

TEST(ExampleKernels, RefuseWhatIsOutOfRange) {
  const auto fine = time_example_kernels({.cell_size = 0.01});
  ASSERT_FALSE(fine.has_value());
  EXPECT_EQ(fine.error().field, "cell_size");
  const auto none = time_example_kernels({.repeats = 0});
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().field, "repeats");
}

}  // namespace
}  // namespace crumple::lab
