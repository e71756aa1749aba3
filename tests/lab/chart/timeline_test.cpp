#include "server/lab/chart/timeline.h"

#include "server/io/scene_file.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace crumple::lab::chart {
namespace {

sim::SceneDescription shipped(const std::string& name) {
  return io::load_scene(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "deploy/scenes" / (name + ".json"))->scene;
}

TEST(Timeline, PartsOfAStepAreItsTimeAndTheWorkloadIsTheWorlds) {
  int runs = 0;
  const auto timeline = run_timeline(shipped("wall"), {.threads = {1, 2}, .steps = 40, .repeats = 2}, [&](int done, int all) {
    EXPECT_EQ(done, ++runs);
    EXPECT_EQ(all, 4);
  });
  ASSERT_TRUE(timeline) << timeline.error().text();
  ASSERT_EQ(timeline->ms.size(), 2u);
  ASSERT_EQ(timeline->contacts.size(), 40u);
  int most_contacts = 0;
  double all = 0, parts = 0;
  for (std::size_t k = 0; k < 40; ++k) {
    all += timeline->ms[1][k];
    for (const auto& part : timeline->parts) {
      EXPECT_GE(part[k], 0);
      parts += part[k];
    }
    most_contacts = std::max(most_contacts, timeline->contacts[k]);
  }
  EXPECT_GT(parts, 0.5 * all);  // every stage is in one part, and little is between them; medians of parts need not add up
  EXPECT_LT(parts, 1.2 * all);
  EXPECT_GT(most_contacts, 20);
  EXPECT_EQ(timeline->workload.front().live_tets, 900);
  EXPECT_LT(timeline->workload.back().live_tets, 900);  // some are rigid fragments now
  EXPECT_GT(timeline->workload.back().rigid_fragments, 0);
}

TEST(Timeline, EveryStageOfAStepIsInOnePart) {
  auto world = sim::World::create(shipped("pane"));
  (*world)->set_clock([] { return 0.0; });
  (*world)->step();
  for (const sim::StageTime& stage : (*world)->stage_times()) {
    int found = 0;
    for (const StepPart& part : step_parts()) found += static_cast<int>(std::ranges::count(part.stages, std::string(stage.name)));
    EXPECT_EQ(found, 1) << stage.name;
  }
}

TEST(Timeline, TheTableHasARowAStepAndTheFigureThreePanels) {
  Timeline timeline{.threads = {1, 4}, .dt = 0.01, .ms = {{1, 2, 3}, {0.5, 1, 2}}, .workload = std::vector<sim::Workload>(3), .contacts = {0, 5, 7}};
  timeline.parts.assign(step_parts().size(), {0.1, 0.2, 0.3});
  std::istringstream csv(timeline_csv(timeline));
  std::vector<std::string> lines;
  for (std::string line; std::getline(csv, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_TRUE(lines[0].starts_with("step,time,ms_1,ms_4,solve,"));
  EXPECT_TRUE(lines[3].starts_with("3,0.03,3,2,0.3,"));
  const Figure drawn = timeline_figure(timeline, "toy", "here");
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  ASSERT_TRUE(draw(drawn, folder.path(), "toy"));
  std::ifstream file(folder.path() / "toy.svg");
  std::stringstream svg;
  svg << file.rdbuf();
  for (const char* words : {"4 threads", "real time", "fracture and plasticity", "sleeping tets", "here"})
    EXPECT_NE(svg.str().find(words), std::string::npos) << words;
}

}  // namespace
}  // namespace crumple::lab::chart
