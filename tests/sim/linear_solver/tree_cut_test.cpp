#include "server/sim/linear_solver/tree_cut.h"

#include <gtest/gtest.h>

namespace crumple::sim::linear_solver {
namespace {

constexpr std::size_t kHeavy = 100000;

TEST(TreeCut, TwoSubtreesAreBranchesAndWhatTheyEndInIsTheTrunk) {
  //   5 <- 4 <- {1 <- 0, 3 <- 2}
  const std::vector<int> parent{1, 4, 3, 4, 5, -1};
  const std::vector<std::size_t> work{kHeavy, kHeavy, kHeavy, kHeavy, kHeavy / 5, kHeavy / 5};
  const TreeCut cut = cut_tree(parent, work);
  EXPECT_EQ(cut.branch, (std::vector<int>{0, 0, 1, 1, -1, -1}));
  EXPECT_DOUBLE_EQ(cut.longest_share, 2.4 / 4.4);
}

TEST(TreeCut, TreesThatDoNotMeetHaveNoTrunk) {
  const TreeCut cut = cut_tree(std::vector<int>{1, -1, -1}, std::vector<std::size_t>{kHeavy, kHeavy, 2 * kHeavy});
  EXPECT_EQ(cut.branch, (std::vector<int>{0, 0, 1}));
  EXPECT_DOUBLE_EQ(cut.longest_share, 0.5);
}

TEST(TreeCut, AChainALopsidedTreeAndALightOneAreAllTrunk) {
  for (const auto& [parent, work] : {std::pair{std::vector<int>{1, 2, -1}, std::vector<std::size_t>{kHeavy, kHeavy, kHeavy}},
                                     {{2, 2, -1}, {9 * kHeavy, kHeavy, 1}},
                                     {{2, 2, -1}, {100, 100, 1}},
                                     {{}, {}}}) {
    const TreeCut cut = cut_tree(parent, work);
    EXPECT_EQ(cut.branch, std::vector<int>(parent.size(), -1));
    EXPECT_EQ(cut.longest_share, 1);
  }
}

}  // namespace
}  // namespace crumple::sim::linear_solver
