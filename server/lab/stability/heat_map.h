#pragma once

#include "server/lab/stability/method.h"

#include <functional>

// Where a method fails in a plane of two parameters.
namespace crumple::lab::stability {

enum class CellState { stable, drifting, growing, inverted, passed, refused, not_finite };
inline constexpr int kCellStates = 7;
const char* name_of(CellState state);    // "stable", "drifting", "energy growing", "inverted for ever", ...
const char* colour_of(CellState state);  // "#rrggbb"
const char* letter_of(CellState state);  // in a cell, for those who do not see colours
// 0 stable ... 5 not finite: whether a boundary has moved inward.
int severity(CellState state);

struct Cell {
  CellState state = CellState::stable;
  std::string note;  // figures; no comma or quote
};

struct Axis {
  std::string name, unit;
  std::vector<double> values;  // ascending
};
std::string label(const Axis& axis, int k);  // "1/60" for times, "1e+06" for the rest

struct HeatMap {
  std::string key, title;
  std::string meaning;  // what a cell is, and what its states mean here
  Family family = Family::fem;
  Axis x, y;
  std::function<Cell(const Method& method, double x, double y)> trial;
  bool iterating_only = false;  // methods with an iteration cap

  std::vector<const Method*> methods() const;  // the family's mapped ones
};

// The seven maps.
const std::vector<HeatMap>& all_maps();

// Cells by y, then x.
using CellGrid = std::vector<std::vector<Cell>>;

// Where the map is stable, in words: one sentence, x values with the same stable y together.
std::string boundary_in_words(const HeatMap& map, const CellGrid& cells);

}  // namespace crumple::lab::stability
