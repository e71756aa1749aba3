#include "server/sim/contact/sweep_and_prune.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace crumple::sim::contact {
namespace {

std::vector<Box3> random_boxes(int count, const Eigen::Vector3d& spread, std::mt19937& random) {
  std::uniform_real_distribution<double> at(0, 1), size(0, 0.2);
  std::vector<Box3> boxes;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d low = spread.cwiseProduct(Eigen::Vector3d(at(random), at(random), at(random)));
    boxes.emplace_back(low, low + Eigen::Vector3d(size(random), size(random), size(random)));
  }
  return boxes;
}

TEST(SweepAndPrune, FindsWhatBruteForceFinds) {
  std::mt19937 random(7);
  for (const Eigen::Vector3d& spread : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.1, 5, 1), Eigen::Vector3d(0, 0, 3)}) {
    const std::vector<Box3> boxes = random_boxes(200, spread, random);
    std::vector<IndexPair> expected;
    for (int i = 0; i < 200; ++i)
      for (int j = i + 1; j < 200; ++j)
        if (boxes[i].intersects(boxes[j])) expected.emplace_back(i, j);
    EXPECT_GT(expected.size(), 20u);
    EXPECT_EQ(sweep_and_prune(boxes), expected);
  }
}

TEST(SweepAndPrune, OfTwoSetsFindsWhatBruteForceFinds) {
  std::mt19937 random(9);
  for (const auto& [of_a, of_b] : {std::pair{120, 80}, std::pair{60, 20}, std::pair{300, 4}, std::pair{400, 4}, std::pair{3, 0}}) {  // swept, or each with each
    std::vector<Box3> a = random_boxes(of_a, {1, 1, 2}, random), b = random_boxes(of_b, {1, 1, 2}, random);
    std::vector<IndexPair> expected, found{{5, 5}};
    for (int i = 0; i < of_a; ++i)
      for (int j = 0; j < of_b; ++j)
        if (a[i].intersects(b[j])) expected.emplace_back(i, j);
    const double infinity = std::numeric_limits<double>::infinity();
    a.emplace_back(Eigen::Vector3d::Constant(-infinity), Eigen::Vector3d::Constant(infinity));  // meets nothing
    a.emplace_back();
    sweep_and_prune(a, b, found);
    EXPECT_EQ(expected.empty(), of_b == 0);
    EXPECT_EQ(found, expected);
  }
}

TEST(SweepAndPrune, TouchingBoxesMeetEmptyAndNonFiniteOnesDoNot) {
  const Eigen::Vector3d one = Eigen::Vector3d::Ones();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Box3> boxes{Box3(Eigen::Vector3d::Zero(), one), Box3(one, 2 * one), Box3(),
                                Box3(nan * one, nan * one), Box3(Eigen::Vector3d::Zero(), nan * one)};
  EXPECT_EQ(sweep_and_prune(boxes), (std::vector<IndexPair>{{0, 1}}));
  EXPECT_TRUE(sweep_and_prune(std::vector<Box3>{}).empty());
}

}  // namespace
}  // namespace crumple::sim::contact
