#include "server/lab/stability/baseline.h"

#include <gmock/gmock.h>

#include <fstream>

namespace crumple::lab::stability {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Baseline known() {
  Baseline baseline;
  baseline.rows[{1, "svd"}] = {Verdict::pass, 0.002, ""};
  baseline.rows[{14, "svd"}] = {Verdict::limit, 2.0, ""};
  baseline.rows[{1, "explicit"}] = {Verdict::fails, 384, ""};
  baseline.cells[{"E-dt", "svd", 2, 3}] = CellState::stable;
  baseline.cells[{"E-dt", "svd", 3, 3}] = CellState::drifting;
  return baseline;
}

Survey as_known() {
  Survey survey;
  for (const auto& [key, outcome] : known().rows) survey.rows[key].outcome = outcome;
  for (const auto& [key, state] : known().cells) survey.cells[key].cell.state = state;
  return survey;
}

TEST(Baseline, NothingChangedIsNothingToSay) {
  const Comparison same = compare(known(), as_known());
  EXPECT_THAT(same.inward, IsEmpty());
  EXPECT_THAT(same.outward, IsEmpty());
}

TEST(Baseline, APassThatBecomesAFailIsNamed) {
  Survey now = as_known();
  now.rows[{1, "svd"}].outcome = {Verdict::fails, 80, "80 of 162 tets stay inverted"};
  const Comparison result = compare(known(), now);
  EXPECT_THAT(result.inward,
              ElementsAre(HasSubstr("row 1, Inverted elements, SVD, backward Euler, block-Jacobi (default): pass")));
  EXPECT_THAT(result.inward[0], HasSubstr("80 of 162"));
  EXPECT_THAT(result.outward, IsEmpty());
}

TEST(Baseline, ALimitMayWanderByHalfAndNoMore) {
  Survey now = as_known();
  now.rows[{14, "svd"}].outcome.value = 2.9;
  EXPECT_THAT(compare(known(), now).inward, IsEmpty());
  now.rows[{14, "svd"}].outcome.value = 3.1;
  EXPECT_THAT(compare(known(), now).inward, ElementsAre(HasSubstr("row 14")));
  now.rows[{14, "svd"}].outcome.value = 1;
  EXPECT_THAT(compare(known(), now).outward, ElementsAre(HasSubstr("row 14")));
}

TEST(Baseline, ABoundaryThatMovesInwardIsNamedOneThatMovesOutwardMayBeRaised) {
  Survey now = as_known();
  now.cells[{"E-dt", "svd", 2, 3}].cell = {CellState::inverted, "12 inverted"};
  now.cells[{"E-dt", "svd", 3, 3}].cell = {CellState::stable, ""};
  const Comparison result = compare(known(), now);
  EXPECT_THAT(result.inward, ElementsAre(HasSubstr("map E-dt, SVD, backward Euler, block-Jacobi (default), E = 100000, "
                                                   "dt = 1/120: stable became inverted for ever")));
  EXPECT_THAT(result.outward, ElementsAre(HasSubstr("drifting became stable")));
}

TEST(Baseline, WhatWasNotRunFellBehind) { EXPECT_EQ(compare(known(), {}).inward.size(), 5u); }

TEST(Baseline, ComesBackFromItsFile) {
  Baseline back;
  std::string error;
  ASSERT_TRUE(from_json(to_json(known()), back, error)) << error;
  EXPECT_EQ(to_json(back), to_json(known()));
  for (const char* bad :
       {R"([])", R"({"rows": {}})", R"({"rows": {"99 svd": {"verdict": "pass"}}, "cells": {}})",
        R"({"rows": {"1 convex": {"verdict": "pass"}}, "cells": {}})",
        R"({"rows": {"1 svd": {"verdict": "fine"}}, "cells": {}})",
        R"({"rows": {}, "cells": {"E-dt svd 99 0": "stable"}})", R"({"rows": {}, "cells": {"E-dt svd 0 0": "good"}})"})
    EXPECT_FALSE(from_json(nlohmann::json::parse(bad), back, error)) << bad;
}

TEST(Baseline, TakesCellsFromBothSidesOfABoundary) {
  Survey full;
  const HeatMap& map = all_maps().front();
  for (int j = 0; j < static_cast<int>(map.y.values.size()); ++j)
    for (int i = 0; i < static_cast<int>(map.x.values.size()); ++i)
      full.cells[{map.key, "svd", i, j}] = {{i < 4 ? CellState::stable : CellState::inverted, ""}, 0.1};
  const auto cells = boundary_cells(full, 10);
  ASSERT_FALSE(cells.empty());
  for (const CellKey& key : cells) EXPECT_TRUE(key.i == 3 || key.i == 4) << key.i;
  EXPECT_TRUE(boundary_cells(full, 0.15).empty());
}

TEST(Baseline, TheCommittedOneHoldsEveryRowAndMap) {
  std::ifstream in(CRUMPLE_SOURCE_DIR "/tests/lab/stability/baseline.json");
  Baseline baseline;
  std::string error;
  ASSERT_TRUE(from_json(nlohmann::json::parse(in, nullptr, false), baseline, error)) << error;
  for (const RowKey& key : rows_of_brief()) EXPECT_TRUE(baseline.rows.contains(key)) << key.first << " " << key.second;
  for (const HeatMap& map : all_maps())
    for (const Method* method : map.methods())
      EXPECT_TRUE(std::ranges::any_of(
          baseline.cells,
          [&](const auto& cell) { return cell.first.map == map.key && cell.first.method == method->key; }))
          << map.key << " " << method->key;
}

}  // namespace
}  // namespace crumple::lab::stability
