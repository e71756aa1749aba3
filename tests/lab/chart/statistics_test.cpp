#include "server/lab/chart/statistics.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace crumple::lab::chart {
namespace {

TEST(Spread, IsLowestAndQuartiles) {
  const Spread s = spread({5, 1, 4, 2, 3});
  EXPECT_EQ(s.low, 1);
  EXPECT_EQ(s.q1, 2);
  EXPECT_EQ(s.median, 3);
  EXPECT_EQ(s.q3, 4);
  EXPECT_EQ(spread({1, 2}).median, 1.5);
  EXPECT_TRUE(std::isnan(spread({}).median));
  EXPECT_EQ(spread({std::nan(""), 7}).median, 7);  // what was not measured does not count
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(spread({inf, inf}).median, inf);
}

std::vector<Observation> power_law(double order, double constant) {
  std::vector<Observation> out;
  for (double h = 1; h > 0.01; h /= 2) out.push_back({h, constant * std::pow(h, order)});
  return out;
}

TEST(ObservedOrder, IsTheExponentOfSyntheticErrors) {
  for (const double order : {0.5, 1.0, 2.0, 3.0}) {
    const auto found = observed_order(power_law(order, 0.3), 0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, order, 1e-12);
  }
}

TEST(ObservedOrder, LeavesOutWhatIsBelowTheFloorOrSaturated) {
  std::vector<Observation> errors = power_law(2, 0.3);
  for (Observation& o : errors) o.error = std::max(o.error, 1e-3);  // a reference that is no better
  EXPECT_GT(2 - *observed_order(errors, 0), 0.1);
  EXPECT_NEAR(*observed_order(errors, 1.5e-3), 2, 1e-12);
  errors.push_back({8, 1.4});  // out of phase: says nothing of the order
  EXPECT_NEAR(*observed_order(errors, 1.5e-3), 2, 1e-12);
}

TEST(ObservedOrder, NeedsThreePoints) {
  EXPECT_FALSE(observed_order(std::vector<Observation>{{1, 0.1}, {0.5, 0.05}}, 0));
  EXPECT_FALSE(observed_order(std::vector<Observation>{{1, 0.1}, {1, 0.1}, {1, 0.1}}, 0));  // no two values of h
}

TEST(ParetoFront, KeepsWhatNoOtherBeatsInBoth) {
  //                                    0           1          2         3          4 (worse than 1)  5 (not run)
  const std::vector<Offer> offers{{0.5, 1}, {0.1, 4}, {0.2, 2}, {0.01, 9}, {0.15, 5}, {std::nan(""), 0.1}};
  EXPECT_THAT(pareto_front(offers), testing::ElementsAre(3, 1, 2, 0));
}

TEST(ParetoFront, OfEqualErrorsTakesTheCheaper) {
  EXPECT_THAT(pareto_front(std::vector<Offer>{{0.1, 3}, {0.1, 2}, {0.1, 2}}), testing::ElementsAre(1));
}

TEST(RelativeL2, IsRelativeToTheReference) {
  EXPECT_DOUBLE_EQ(relative_l2(std::vector<double>{3, 5}, std::vector<double>{3, 4}), 0.2);
  EXPECT_DOUBLE_EQ(relative_l2(std::vector<double>{3, 4}, std::vector<double>{0, 0}), 5);
}

TEST(Statistics, LargestOfSamplesIsTheMaximumOverTime) {
  // Two samples of two entries: differences 0 and 5, sizes 1 and 10.
  EXPECT_DOUBLE_EQ(largest_of_samples(std::vector<double>{1, 0, 9, 14}, std::vector<double>{1, 0, 6, 8 + 2}, 2),
                   5 / std::sqrt(36.0 + 100));
  EXPECT_DOUBLE_EQ(largest_of_samples(std::vector<double>{3, 4}, std::vector<double>{0, 0}, 2), 5);
}

}  // namespace
}  // namespace crumple::lab::chart
