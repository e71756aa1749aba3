// From points to files: verdicts, figures of every kind, the page.
#include "server/lab/chart/figure.h"
#include "server/lab/chart/labels.h"
#include "server/lab/chart/page.h"
#include "server/lab/chart/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace crumple::lab::chart {
namespace {

Point point(const std::string& curve, double value, double error, double seconds, const std::string& failure = "") {
  Point p{.study = "s", .curve = curve, .label = std::to_string(value), .value = value, .runs = 3, .failure = failure};
  const auto same = [](double v) { return Spread{v, v, v, v}; };
  p.measured = {{"error", same(error)}, {"seconds", {seconds, seconds, seconds, 1.1 * seconds}}, {"iterations", same(10 / value)}, {"ms_per_step", same(1)}};
  return p;
}

Study study(FigureKind kind = FigureKind::work_precision) {
  Study s{.name = "a-study", .title = "A <study> & its title", .scene = "Scene.", .reference = "Reference.", .kind = kind, .value_axis = "h"};
  s.curves = {{"fine", {}, {}, 1}, {"coarse", {}, {}, 2}};
  s.more = {{"iterations", "iterations"}, {"value", "h"}};
  s.peers = {{"others", 0.05, 0.5}};
  s.statistics = {"error", "seconds"};
  return s;
}

// fine is of first order, coarse of first where second is expected; its last point failed.
std::vector<Point> points() {
  std::vector<Point> out;
  for (double h : {0.4, 0.2, 0.1, 0.05, 0.025}) out.push_back(point("fine", h, 0.5 * h, 0.1 / h));
  for (double h : {0.4, 0.2, 0.1, 0.05}) out.push_back(point("coarse", h, h, 0.05 / h));
  out.push_back(point("coarse", 0.025, std::nan(""), 1, "not finite"));
  return out;
}

TEST(Verdict, FlagsOrdersThatAreMissed) {
  const auto found = orders(study(), points());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].observed, 1, 1e-12);
  EXPECT_TRUE(found[0].met());
  EXPECT_FALSE(found[1].met());
  EXPECT_NE(conclusion(study(), points()).find("MISSED"), std::string::npos);
}

TEST(Verdict, FindsTheCheapestSettingThatIsGoodEnoughAndDidNotFail) {
  auto all = points();
  all.push_back(point("coarse", 1, 1e-9, 1e-9, "hit the cap"));
  const Point* p = cheapest(all, 0.1);
  ASSERT_TRUE(p);
  EXPECT_EQ(p->curve, "fine");  // error 0.1 at 0.5 s, before coarse's 0.1 at 0.5 s
  EXPECT_DOUBLE_EQ(p->median("seconds"), 0.5);
  EXPECT_EQ(cheapest(all, 1e-6), nullptr);
  const std::string words = conclusion(study(), all);
  EXPECT_NE(words.find("2 settings failed"), std::string::npos) << words;
  EXPECT_NE(words.find("Nothing here meets 1 %"), std::string::npos) << words;
  EXPECT_NE(words.find("measured by others"), std::string::npos) << words;
}

TEST(Verdict, LooksForTheCheapestOfEachCurveWhereCurvesAreScenes) {
  Study s = study();
  s.scene_a_curve = true;
  const std::string words = conclusion(s, points());
  EXPECT_NE(words.find("fine: The cheapest within 10 %"), std::string::npos) << words;
  EXPECT_NE(words.find("coarse: The cheapest within 10 %"), std::string::npos) << words;
  const std::string html = page({{&s, points(), "<svg></svg>"}}, {}, "");
  EXPECT_NE(html.find("</a>: fine</td>"), std::string::npos);
  EXPECT_NE(html.find("</a>: coarse</td>"), std::string::npos);
}

TEST(Verdict, SaysWhatARigidBodyMeets) {
  Study s = study();
  s.curves[1].base.body = BodyKind::rigid;
  auto all = points();
  for (Point& p : all) {
    if (p.curve != "coarse") continue;
    p.measured["error"] = {1, 1, 1, 1};
    p.measured["error_motion"] = {0.001, 0.001, 0.001, 0.001};
  }
  const std::string words = conclusion(s, all);
  EXPECT_NE(words.find("A rigid body does not meet 10 % in the shape, meets 1 % in where it goes."), std::string::npos) << words;
}

TEST(Verdict, NamesTheLargestPart) {
  Point p = point("fine", 1, 0.1, 1);
  EXPECT_EQ(dominating_part(p), "");
  p.measured["error_solver"] = p.measured["error_mesh"] = {0.01, 0.01, 0.01, 0.01};
  p.measured["error_time"] = {0.09, 0.09, 0.09, 0.09};
  EXPECT_EQ(dominating_part(p), "time");
}

TEST(LabelPlacer, LabelsDoNotCoverEachOtherAndStayInside) {
  LabelPlacer placer(100, 100);
  placer.keep_free(50, 50);
  struct Rectangle { double left, right, bottom, top; };
  std::vector<Rectangle> placed;
  for (int k = 0; k < 12; ++k) {
    const auto at = placer.place(50, 50, "1/60");
    if (!at) continue;
    placed.push_back({50 + at->dx - 10, 50 + at->dx + 10, 50 + at->dy - 5, 50 + at->dy + 5});
  }
  EXPECT_GE(placed.size(), 4u);
  EXPECT_LE(placed.size(), 8u);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    EXPECT_GE(placed[i].left, 0);
    for (std::size_t j = 0; j < i; ++j) {
      const bool apart = placed[i].left >= placed[j].right || placed[j].left >= placed[i].right || placed[i].bottom >= placed[j].top || placed[j].bottom >= placed[i].top;
      EXPECT_TRUE(apart) << i << " " << j;
    }
  }
  EXPECT_FALSE(placer.place(2, 50, "a label far wider than what the panel has"));
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Figure, EveryKindIsDrawnAndSaysWhereItComesFrom) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  const test::TemporaryFolder folder;
  for (const FigureKind kind : {FigureKind::work_precision, FigureKind::pareto, FigureKind::against_value, FigureKind::cost, FigureKind::ensemble}) {
    const std::string name = "kind-" + std::to_string(static_cast<int>(kind));
    const auto drawn = draw(figure(study(kind), points(), {"machine; compiler", "commit 0123abc; scene 42"}), folder.path(), name);
    ASSERT_TRUE(drawn) << drawn.error().text();
    const std::string svg = contents(folder.path() / (name + ".svg"));
    EXPECT_NE(svg.find("commit 0123abc; scene 42"), std::string::npos) << name;
    EXPECT_EQ(svg.rfind("</svg>") , svg.find_last_not_of("\n ") - 5) << name;  // whole
    EXPECT_EQ(contents(folder.path() / (name + ".png")).substr(1, 3), "PNG") << name;
  }
}

TEST(Page, ShowsWhereTheTimeGoesAndWhatElseWasMeasured) {
  const Study s = study();
  auto all = points();
  all[0].measured["ms_solve"] = {3, 3, 3, 3};
  all[0].measured["error_max"] = {0.2, 0.2, 0.2, 0.2};
  const std::string html = page({{&s, all, "<svg></svg>"}}, {}, "");
  EXPECT_NE(html.find("<th>solve</th>"), std::string::npos);
  EXPECT_NE(html.find("<th>largest error over time</th>"), std::string::npos);
  EXPECT_EQ(html.find("<th>contact</th>"), std::string::npos);
}

TEST(Figure, AFolderThatDoesNotExistIsAnError) {
  if (!find_gnuplot()) GTEST_SKIP() << find_gnuplot().error().text();
  EXPECT_FALSE(draw(figure(study(), points(), {"f", "g"}), "/nowhere/at/all", "x"));
}

TEST(Page, IsOneFileWithEveryStudyAndNothingFromOutside) {
  const Study a = study();
  Study b = study();
  b.name = "unmet";
  b.unmet = "Reference not at hand.";
  const std::string html = page({{&a, points(), "<?xml?><svg>figure</svg>"}, {&b, {}, ""}}, {{"BDF2", "not yet"}}, "Made here.");
  EXPECT_NE(html.find("<svg>figure</svg>"), std::string::npos);
  EXPECT_EQ(html.find("<?xml"), std::string::npos);
  EXPECT_NE(html.find("A &lt;study&gt; &amp; its title"), std::string::npos);
  EXPECT_NE(html.find("Reference not at hand."), std::string::npos);
  EXPECT_NE(html.find("BDF2"), std::string::npos);
  EXPECT_NE(html.find("missed"), std::string::npos);
  EXPECT_EQ(html.find("http://"), std::string::npos);
  EXPECT_EQ(html.find("https://"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
}

}  // namespace
}  // namespace crumple::lab::chart
