#include "server/authoring/scoring.h"

#include "server/authoring/shapes/box_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple::authoring {
namespace {

using By = ScoreOptions::By;
using ::testing::HasSubstr;

// A bar along z; scoring looks at its tets alone.
sim::example_based::ExampleSet bar() {
  sim::example_based::ExampleSet set;
  set.mesh = *centred_box_mesh({1, 1, 4}, {2, 2, 8}, Lattice::bcc);
  return set;
}

TEST(Scoring, SlabsAreEvenAlongTheLongestSide) {
  const auto cells = scored_cells(bar(), {.by = By::planes, .pieces = 4});
  ASSERT_TRUE(cells) << cells.error().text();
  ASSERT_EQ(cells->size(), 4u);
  for (const SplinterCell& cell : *cells) EXPECT_NEAR(cell.box.sizes().z(), 1, 1e-12);
}

TEST(Scoring, VoronoiSitesFollowTheSeedAndCellsFillTheBox) {
  const auto one = scored_cells(bar(), {.pieces = 20, .seed = 3}),
             same = scored_cells(bar(), {.pieces = 20, .seed = 3}),
             other = scored_cells(bar(), {.pieces = 20, .seed = 4});
  ASSERT_TRUE(one && same && other);
  ASSERT_EQ(one->size(), 20u);
  Eigen::AlignedBox3d all;
  for (std::size_t k = 0; k < 20; ++k) {
    EXPECT_EQ((*one)[k].box.min(), (*same)[k].box.min());
    all.extend((*one)[k].box);
  }
  EXPECT_NE((*one)[0].box.min(), (*other)[0].box.min());
  EXPECT_LT((all.sizes() - Vec3(1, 1, 4)).norm(), 1e-9);
}

TEST(Scoring, BlocksAndGrainAreAsAskedFor) {
  const auto bricks = scored_cells(bar(), {.by = By::bricks, .block = Vec3(0.5, 0.25, 2)});
  ASSERT_TRUE(bricks) << bricks.error().text();
  Vec3 largest = Vec3::Zero();
  for (const SplinterCell& cell : *bricks) largest = largest.cwiseMax(cell.box.sizes());
  EXPECT_LT((largest - Vec3(0.5, 0.25, 2)).norm(), 1e-9);
  for (const bool along_x : {false, true}) {
    const auto wood = scored_cells(
        bar(), {.by = By::wood, .size = 0.2, .aspect = 5, .direction = along_x ? Vec3(2, 0, 0) : Vec3(0, 0, 0)});
    ASSERT_TRUE(wood) << wood.error().text();
    Vec3 mean = Vec3::Zero();
    for (const SplinterCell& cell : *wood)
      if (!cell.box.isEmpty()) mean += cell.box.sizes();
    EXPECT_GT(mean[along_x ? 0 : 2], 1.5 * mean.y());
  }
}

TEST(Scoring, BadInputIsAnError) {
  const auto says = [](const ScoreOptions& o) {
    const auto cells = scored_cells(bar(), o);
    return cells ? "" : cells.error().text();
  };
  EXPECT_THAT(says({.pieces = 1}), HasSubstr("pieces is 1, must be in [2, 1000]"));
  EXPECT_THAT(says({.size = -1}), HasSubstr("size is -1 m"));
  EXPECT_THAT(says({.aspect = 0.5}), HasSubstr("aspect is 0.5"));
  EXPECT_THAT(says({.block = Vec3(1, -1, 1)}), HasSubstr("block is 1 -1 1 m"));
  EXPECT_THAT(says({.by = By::planes, .planes = {{Vec3::Zero(), 1}}}), HasSubstr("planes[0]"));
  EXPECT_THAT(says({.by = By::stone, .size = 0.001}), HasSubstr("size makes about"));
}

}  // namespace
}  // namespace crumple::authoring
