// Running a table of studies: what is written, what is run again, what is kept of failures.
#include "server/lab/chart/chart_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace crumple::lab::chart {
namespace {

constexpr std::uint64_t kScene = 0x1234;

// A study whose measure counts how often it is called: error = value^2, cost 1 / value.
Study counted(int& calls, std::uint64_t scene = kScene) {
  Study study{.name = "counted", .title = "Counted", .scene = "none", .reference = "none"};
  study.measure = {[&calls](const Setup& setup, Workshop&) -> Result<Sample> {
                     ++calls;
                     Sample sample{{{"error", setup.dt * setup.dt}, {"seconds", 1 / setup.dt + 0.001 * setup.seed}, {"seed", static_cast<double>(setup.seed)}}, ""};
                     if (setup.dt > 0.9) sample.failure = "diverged, \"really\"";
                     return sample;
                   },
                   [scene](const Setup&, Workshop&) -> Result<std::uint64_t> { return scene; }};
  Knob knob{"h", {{0.1, "a"}, {0.2, "b"}, {0.4, "c, with comma"}, {1.0, "d"}}, [](Setup& s, double v) { s.dt = v; }};
  study.curves = {{"one", knob, {}}};
  return study;
}

// A study whose set-up is always refused.
Study refused() {
  Study study{.name = "refused", .title = "Refused", .scene = "none", .reference = "none"};
  study.measure = {[](const Setup&, Workshop&) -> Result<Sample> { return invalid("dt", "is 0"); },
                   [](const Setup&, Workshop&) -> Result<std::uint64_t> { return kScene; }};
  study.curves = {{"one", {"h", {{1, "a"}}, [](Setup&, double) {}}, {}}};
  return study;
}

class ChartRun : public testing::Test {
 protected:
  std::vector<Point> run(const Study& study, int runs = 3) {
    auto points = run_studies({study}, {.points_file = file(), .runs = runs, .seeds = 4}, workshop_, [](int, int, const std::string&, double) {});
    EXPECT_TRUE(points) << points.error().text();
    return points ? *points : std::vector<Point>{};
  }
  std::filesystem::path file() const { return folder_.path() / "points.csv"; }
  test::TemporaryFolder folder_;
  Workshop workshop_;
};

TEST_F(ChartRun, RunsEachPointSoOftenAndWritesIt) {
  int calls = 0;
  const auto points = run(counted(calls));
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(calls, 3 * 3 + 1);  // the one that fails is not repeated
  EXPECT_DOUBLE_EQ(points[2].median("error"), 0.4 * 0.4);
  EXPECT_EQ(points[0].scene_hash, "0000000000001234");
  EXPECT_FALSE(points[0].commit.empty() || points[0].machine.empty() || points[0].compiler.empty());
  // The file says the same.
  const auto read = read_points(file());
  ASSERT_EQ(read.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(read[k].label, points[k].label);
    EXPECT_EQ(read[k].failure, points[k].failure);
    EXPECT_EQ(read[k].machine, points[k].machine);
    EXPECT_EQ(read[k].runs, points[k].runs);
    EXPECT_NEAR(read[k].median("seconds"), points[k].median("seconds"), 1e-8);
  }
}

TEST_F(ChartRun, KeepsFailures) {
  int calls = 0;
  const auto points = run(counted(calls));
  EXPECT_EQ(points[3].failure, "diverged, \"really\"");
  EXPECT_EQ(points[3].runs, 1);
  EXPECT_DOUBLE_EQ(points[3].median("error"), 1);
}

TEST_F(ChartRun, GoesOnWhereItWasInterrupted) {
  int calls = 0;
  run(counted(calls));
  // Cut the file in the middle of its third point.
  std::ifstream in(file());
  std::string head, line;
  for (int k = 0; k < 3 && std::getline(in, line); ++k) head += line + "\n";
  std::getline(in, line);
  in.close();
  std::ofstream(file()) << head << line.substr(0, line.size() / 2);
  calls = 0;
  const auto points = run(counted(calls));
  EXPECT_EQ(calls, 3 + 1);  // the third and the fourth
  ASSERT_EQ(points.size(), 4u);
  calls = 0;
  run(counted(calls));
  EXPECT_EQ(calls, 0);
}

TEST_F(ChartRun, RunsAgainWhenTheSceneChangedOrMoreRunsAreAsked) {
  int calls = 0;
  run(counted(calls));
  calls = 0;
  run(counted(calls, kScene + 1));
  EXPECT_EQ(calls, 3 * 3 + 1);
  calls = 0;
  run(counted(calls, kScene + 1), 5);
  EXPECT_EQ(calls, 3 * 5);  // one run was enough to know that the last fails
}

// A point of the counted study as a file of another commit holds it.
Point stored(const std::string& label, const std::string& commit, double error) {
  Point p{.study = "counted", .curve = "one", .label = label, .runs = 10, .commit = commit};
  p.measured["error"] = {error, error, error, error};
  return p;
}

TEST(NewestPoints, AreThoseOfTheCommitThatWasMeasuredLastInTheOrderOfTheTable) {
  int calls = 0;
  const Study study = counted(calls);
  Point other = stored("a", "newer", 9);
  other.study = "another";
  const std::vector<Point> file{stored("a", "old", 1),   stored("b", "old", 1),    stored("b", "new", 2),        stored("a", "new", 2),
                                stored("a", "new", 3),   stored("gone", "new", 2), stored("a", "newer quick", 4), other};
  const auto points = newest_points(file, study);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].label, "a");
  EXPECT_EQ(points[0].median("error"), 3);  // the last one of that commit
  EXPECT_EQ(points[1].label, "b");
  EXPECT_EQ(points[1].commit, "new");
  // Quick points where there are no others.
  const auto quick = newest_points({stored("a", "newer quick", 4)}, study);
  ASSERT_EQ(quick.size(), 1u);
  EXPECT_TRUE(is_quick(quick[0]));
  EXPECT_TRUE(newest_points({}, study).empty());
}

TEST_F(ChartRun, EnsemblesCountTheirSeedsUp) {
  int calls = 0;
  Study study = counted(calls);
  study.seeds = true;
  const auto points = run(study);
  EXPECT_EQ(points[0].runs, 4);
  EXPECT_EQ(points[0].measured.at("seed").low, 1);
  EXPECT_EQ(points[0].median("seed"), 2.5);
}

TEST_F(ChartRun, ARefusedSetupIsAFailedPoint) {
  const auto points = run(refused());
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].failure, "dt is 0");
}

TEST_F(ChartRun, AFolderThatCannotBeWrittenIsAnError) {
  int calls = 0;
  const auto points = run_studies({counted(calls)}, {.points_file = folder_.path() / "no" / "points.csv"}, workshop_, [](int, int, const std::string&, double) {});
  ASSERT_FALSE(points);
  EXPECT_EQ(points.error().field, "--out");
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace crumple::lab::chart
