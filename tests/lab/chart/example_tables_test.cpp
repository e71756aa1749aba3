#include "server/lab/chart/example_tables.h"

#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace crumple::lab::chart {
namespace {

int lines_with(const std::string& text, const std::string& part) {
  std::istringstream in(text);
  int count = 0;
  for (std::string line; std::getline(in, line);) count += line.find(part) != std::string::npos;
  return count;
}

TEST(ExampleTables, AreOfRunsThatAgreeAndTheirPartsAreInTheStep) {
  int runs = 0;
  const auto timed = time_example_scene("dock", {.threads = 1, .repeats = 2, .steps = 260}, [&](int done, int all) {
    EXPECT_EQ(done, ++runs);
    EXPECT_EQ(all, 2);
  });
  ASSERT_TRUE(timed) << timed.error().text();
  ASSERT_EQ(timed->whole.size(), 260u);
  EXPECT_EQ(timed->assets[0]["bodies"], 3);
  double parts = 0, deformation = 0, whole = 0;
  for (std::size_t k = 0; k < 260; ++k) {
    whole += timed->whole[k];
    deformation += timed->deformation[k];
    for (const auto& part : timed->parts) parts += part[k];
  }
  EXPECT_GT(deformation, 0);
  EXPECT_LT(deformation, whole);
  // One thread: processor time is the stage's, but for what lies between the parts. Medians need not add up.
  EXPECT_NEAR(parts, deformation, 0.3 * deformation);

  const std::string tables = example_tables_markdown({&*timed, 1}, "here");
  EXPECT_EQ(lines_with(tables, "| dock |"), 3);
  EXPECT_EQ(lines_with(tables, "0.36 + 0.55"), 1);
  EXPECT_EQ(lines_with(tables, "`crumple-lab tables`: here."), 1);
  EXPECT_EQ(lines_with(example_tables_csv({&*timed, 1}), ""), 2);

  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  ASSERT_TRUE(draw(frame_figure(*timed, "here"), folder.path(), "dock"));
  std::ifstream file(folder.path() / "dock.svg");
  std::stringstream svg;
  svg << file.rdbuf();
  for (const char* words : {"rigid bodies", "skinning", "whole step", "here"}) EXPECT_NE(svg.str().find(words), std::string::npos) << words;
}

TEST(ExampleTables, TakeThePlaceOfThoseOfAPage) {
  const std::string page = "before\n<!-- crumple-lab tables -->\nold\n<!-- end of crumple-lab tables -->\nafter\n";
  const auto changed = with_tables(page, "new\n");
  ASSERT_TRUE(changed);
  EXPECT_EQ(*changed, "before\n<!-- crumple-lab tables -->\nnew\n<!-- end of crumple-lab tables -->\nafter\n");
  EXPECT_EQ(*with_tables(*changed, "new\n"), *changed);
  const auto missing = with_tables("before\n<!-- crumple-lab tables -->\n", "new\n");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().field, "--page");
}

TEST(ExampleTables, AnUnknownSceneIsNamed) {
  const auto timed = time_example_scene("harbour", {}, [](int, int) {});
  ASSERT_FALSE(timed);
  EXPECT_EQ(timed.error().field, "scene");
}

}  // namespace
}  // namespace crumple::lab::chart
