#pragma once

#include "server/lab/stability/survey.h"

// What is known of rows and boundary cells, and whether a run has fallen behind it.
namespace crumple::lab::stability {

struct Baseline {
  std::map<RowKey, Outcome> rows;      // of the brief effort; texts are left out
  std::map<CellKey, CellState> cells;  // on both sides of the boundaries
};

// Format: {"rows": {"1 svd": {"verdict", "value"}}, "cells": {"E-dt svd 3 4": "stable"}}.
nlohmann::json to_json(const Baseline& baseline);
// Entries of rows, maps, methods or cells that do not exist are an error: the text says which.
bool from_json(const nlohmann::json& json, Baseline& baseline, std::string& error);

// For each map and method the cheapest pairs of neighbours of which one is stable; where all or none are, two corners.
// Costs at most `budget` seconds in all, as measured in `full`.
std::vector<CellKey> boundary_cells(const Survey& full, double budget);

struct Comparison {
  std::vector<std::string> inward;   // what fell behind, one sentence each, with row or map named
  std::vector<std::string> outward;  // what got better: the baseline may be raised
};
// Inward: a worse verdict; a limit whose value grew by more than half; a row or cell of the baseline that was not run;
// a cell of a worse state.
Comparison compare(const Baseline& baseline, const Survey& now);

}  // namespace crumple::lab::stability
