// crumple-lab chart as a program, on its smallest studies.
#include "server/lab/chart/figure.h"
#include "server/lab/chart/point.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace crumple::lab::chart {
namespace {

int lab(std::vector<std::string> words, std::string* line = nullptr) {
  words.insert(words.begin(), test::program("crumple-lab"));
  test::ChildProcess child(words);
  EXPECT_TRUE(child.started());
  const std::string first = child.read_line();
  if (line) *line = first;
  return child.wait();
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ChartProgram, AQuickRunOfOneStudyGivesAPageFiguresAndPoints) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "charts").string();
  std::string line;
  ASSERT_EQ(lab({"chart", "--out", out, "--quick", "--only", "sink", "--references", "/nowhere"}, &line), 0);
  EXPECT_EQ(nlohmann::json::parse(line)["points"], 5);
  const auto points = read_points(out + "/points.csv");
  ASSERT_EQ(points.size(), 5u);
  for (const Point& p : points) {
    EXPECT_EQ(p.failure, "") << p.label;
    EXPECT_EQ(p.scene_hash, points.front().scene_hash);
  }
  // v = m g / (phi A), to what the block's own bounce leaves; soft contact sinks too far for it.
  EXPECT_LT(points[1].median("error"), 0.01);
  EXPECT_LT(points[2].median("error"), 0.01);
  const std::string html = contents(out + "/index.html");
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_NE(html.find(points[0].scene_hash), std::string::npos);
  EXPECT_FALSE(contents(out + "/sink.png").empty());
  // A second run measures nothing again.
  const std::string before = contents(out + "/points.csv");
  ASSERT_EQ(lab({"chart", "--out", out, "--quick", "--only", "sink", "--references", "/nowhere"}), 0);
  EXPECT_EQ(contents(out + "/points.csv"), before);
}

TEST(ChartProgram, OneStudyAnewLeavesTheOthersInThePage) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  const std::string out = folder.path().string();
  // What an earlier commit left.
  Point old{.study = "law", .curve = "simple shear", .label = "0.01", .value = 0.01, .runs = 10};
  old.measured["error"] = {0.01, 0.01, 0.01, 0.01};
  old.scene_hash = "00000000000000aa";
  old.commit = "0123456789";
  old.machine = "another machine";
  old.compiler = "another compiler";
  folder.write("points.csv", csv_header() + "\n" + csv_line(old) + "\n");
  std::string line;
  ASSERT_EQ(lab({"chart", "--out", out, "--quick", "--only", "law-stretch"}, &line), 0);
  EXPECT_EQ(nlohmann::json::parse(line)["points"], 7);  // run now
  const std::string html = contents(out + "/index.html");
  EXPECT_NE(html.find("id=\"law\""), std::string::npos);
  EXPECT_NE(html.find("id=\"law-stretch\""), std::string::npos);
  EXPECT_NE(html.find("commit 0123456789"), std::string::npos);
  EXPECT_NE(html.find("another machine"), std::string::npos);
  EXPECT_NE(html.find("Only 1 of 7 settings"), std::string::npos);
  EXPECT_NE(html.find("Not measured yet: pareto"), std::string::npos);
  EXPECT_EQ(html.find("id=\"pareto\""), std::string::npos);
  EXPECT_FALSE(contents(out + "/law.png").empty());
}

TEST(ChartProgram, GapsOfTheLawsAreOfFirstOrder) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  ASSERT_EQ(lab({"chart", "--out", folder.path().string(), "--quick", "--only", "law-stretch"}), 0);
  const auto points = read_points(folder.path() / "points.csv");
  ASSERT_GE(points.size(), 5u);
  // Uniaxial strain e: P_xx is (lambda + 2 mu) e against (1 + e)(e + e^2/2)(lambda + 2 mu); to first order 3/2 e apart, and
  // the transverse stresses lambda e against lambda (e + e^2/2) 1/2 e. With nu = 0.3 lambda / (lambda + 2 mu) = 3/7.
  const double ratio = 3.0 / 7, e = points[0].value;
  const double gap = std::sqrt(std::pow(1.5 * e, 2) + 2 * std::pow(ratio * 0.5 * e, 2)) / std::sqrt(1 + 2 * ratio * ratio);
  EXPECT_NEAR(points[0].median("error"), gap, 0.01 * gap);
}

TEST(ChartProgram, RefusesAStudyThatDoesNotExist) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  EXPECT_EQ(lab({"chart", "--out", folder.path().string(), "--only", "no-such-study"}), 2);
}

}  // namespace
}  // namespace crumple::lab::chart
