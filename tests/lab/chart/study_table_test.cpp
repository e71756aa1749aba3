// The table of studies: complete, named once, every curve with five points or a reason.
#include "server/lab/chart/figure.h"
#include "server/lab/chart/pinning.h"
#include "server/lab/chart/study.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/shared_data.h"

namespace crumple::lab::chart {
namespace {

Workshop with_references() { return {.yardstick = test::shared_data("yardstick")}; }
Workshop without_references() { return {.yardstick = "/nowhere"}; }

TEST(StudyTable, EveryCurveHasFivePointsOrSaysWhyNot) {
  for (const Workshop& workshop : {with_references(), without_references()}) {
    for (const Study& study : studies(workshop)) {
      EXPECT_TRUE(!study.curves.empty() || !study.unmet.empty()) << study.name;
      for (const Curve& curve : study.curves) {
        EXPECT_TRUE(curve.knob.values.size() >= 5 || !curve.why_few.empty()) << study.name << " / " << curve.name;
      }
    }
  }
}

TEST(StudyTable, FiguresTellTheCurvesApart) {
  for (const Study& study : studies(with_references()))
    EXPECT_LE(study.curves.size(), study.kind == FigureKind::pareto ? kPointShapes : kMostCurves) << study.name;
}

TEST(StudyTable, NamesAreUniqueAndEveryStudyIsExplained) {
  std::set<std::string> names;
  for (const Study& study : studies(without_references())) {
    EXPECT_TRUE(names.insert(study.name).second) << study.name;
    EXPECT_FALSE(study.title.empty() || study.scene.empty() || study.reference.empty()) << study.name;
    std::set<std::string> curves;
    for (const Curve& curve : study.curves) {
      EXPECT_TRUE(curves.insert(curve.name).second) << study.name << " / " << curve.name;
      std::set<std::string> labels;
      for (const KnobValue& v : curve.knob.values) EXPECT_TRUE(labels.insert(v.label).second) << curve.name << " " << v.label;
    }
  }
}

TEST(StudyTable, EveryPartOfTheErrorHasAStudy) {
  std::set<std::string> names;
  for (const Study& study : studies(without_references())) names.insert(study.name);
  for (const char* part : {"pareto", "solver", "time", "mesh", "law", "dent", "precision", "sink", "rest", "friction", "wire", "threads", "pile", "panel"}) {
    EXPECT_TRUE(names.contains(part)) << part;
  }
  EXPECT_FALSE(not_built().empty());
}

TEST(StudyTable, SaysThatReferencesAreNotAtHand) {
  for (const Study& study : studies(without_references())) {
    if (study.name == "cases" || study.name == "law-cases") EXPECT_NE(study.unmet.find("not at hand"), std::string::npos) << study.name;
    else EXPECT_TRUE(study.unmet.empty()) << study.name;
    if (study.name == "time" || study.name == "mesh") EXPECT_NE(study.reference.find("not at hand"), std::string::npos) << study.name;
  }
}

TEST(Knobs, EveryValueTurnsTheSetup) {
  chart::Setup setup;  // testing::Test has a Setup of its own
  const Knob dt = knobs::dt();
  dt.turn(setup, dt.values.front().value);
  EXPECT_DOUBLE_EQ(setup.dt, 1.0 / 15);
  EXPECT_EQ(dt.values.front().label, "1/15");
  EXPECT_EQ(dt.values.back().label, "1/960");
  knobs::cg_cap().turn(setup, 40);
  EXPECT_EQ(setup.cg_cap, 40);
  EXPECT_LE(setup.cg_tolerance, 1e-12);  // out of reach: the cap decides
  const Knob grid = knobs::grid({0.1, 0.05}, {1e-1, 1e-2, 1e-3}, 0);
  ASSERT_EQ(grid.values.size(), 6u);
  grid.turn(setup, grid.values[5].value);
  EXPECT_DOUBLE_EQ(setup.dt, 0.05);
  EXPECT_DOUBLE_EQ(setup.cg_tolerance, 1e-3);
  const Knob levels = knobs::levels({"L0", "L1"});
  levels.turn(setup, levels.values[1].value);
  EXPECT_EQ(setup.level, "L1");
  EXPECT_EQ(static_cast<int>(knobs::threads().values.size()), 1 + static_cast<int>(std::log2(allowed_processors())));
}

TEST(Pinning, HoldsOneProcessorAndGivesTheOthersBack) {
  const int before = allowed_processors();
  {
    const Pinning pinned(1);
    if (!pinned.held()) GTEST_SKIP() << "the system does not let a process pin itself";
    EXPECT_EQ(allowed_processors(), 1);
  }
  EXPECT_EQ(allowed_processors(), before);
}

}  // namespace
}  // namespace crumple::lab::chart
