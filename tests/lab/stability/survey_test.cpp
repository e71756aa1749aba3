#include "server/lab/stability/isolated.h"
#include "server/lab/stability/step_times.h"
#include "server/lab/stability/survey.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <csignal>
#include <fstream>

namespace crumple::lab::stability {
namespace {

TEST(Isolated, AnswersAndSurvivesACrashAndAnEndlessCheck) {
  EXPECT_EQ(run_isolated([] { return std::string(100'000, 'x'); }).answer.size(), 100'000u);
  const Isolated crash = run_isolated([]() -> std::string {
    raise(SIGKILL);  // not SIGSEGV, which sanitizers catch
    return "";
  });
  EXPECT_FALSE(crash.finished);
  EXPECT_EQ(crash.ending, "ended by signal 9");
  const Isolated endless = run_isolated(
      []() -> std::string {
        while (true) pause();
      },
      1);
  EXPECT_FALSE(endless.finished);
  EXPECT_EQ(endless.ending, "no answer within 1 s");
}

TEST(Survey, TakesFinishedJobsFromTheJournalAndCutOffOnesNot) {
  test::TemporaryFolder folder;
  folder.write(
      "journal",
      R"({"key": "row 33 eq8", "seconds": 1, "answer": {"verdict": "limit", "value": 42, "text": "from the journal"}})"
      "\n{\"key\": \"row 33 eq9\", \"sec");
  const std::filesystem::path journal = folder.path() / "journal";
  const Plan plan{.effort = {.brief = true}, .rows = {{33, "eq8"}, {33, "eq9"}}};
  Survey survey = run_survey(plan, journal);
  EXPECT_EQ(survey.rows[(RowKey{33, "eq8"})].outcome.text, "from the journal");
  EXPECT_EQ(survey.rows[(RowKey{33, "eq9"})].outcome.verdict, Verdict::pass);
  std::ifstream in(journal);
  std::string line;
  std::getline(in, line);
  std::getline(in, line);
  EXPECT_NE(line.find("row 33 eq9"), std::string::npos);
}

TEST(StepTimes, CompareTheSlowestStepWithTheMedianAndShortOnesWithAMillisecond) {
  StepTimes times;
  EXPECT_EQ(times.worst(), 0);
  times.add({0.004, 0.005, 0.020, 0.005, 0.004});
  EXPECT_DOUBLE_EQ(times.worst(), 4);
  times.add({1e-6, 1e-6, 2e-3});
  EXPECT_DOUBLE_EQ(times.worst(), 4);
  times.add({1e-6, 1e-6, 5e-3});
  EXPECT_DOUBLE_EQ(times.worst(), 5);
}

TEST(Survey, TakesDownTheSlowestStepOfARow) {
  const Survey survey = run_survey({.effort = {.brief = true}, .rows = {{6, "svd"}}}, {});
  EXPECT_GT(survey.rows.at({6, "svd"}).slowest_step, 0);
}

TEST(Survey, FullPlanHoldsEveryRowForEveryMethodOfItsFamily) {
  const Plan plan = full_plan();
  std::size_t rows = 0, cells = 0;
  for (const Row& row : all_rows()) rows += methods_of(row.family).size();
  for (const HeatMap& map : all_maps()) cells += map.methods().size() * map.x.values.size() * map.y.values.size();
  EXPECT_EQ(plan.rows.size(), rows);
  EXPECT_EQ(plan.cells.size(), cells);
}

}  // namespace
}  // namespace crumple::lab::stability
