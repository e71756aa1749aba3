#include "server/lab/stability/heat_map.h"

#include "common/text.h"

#include <cmath>

namespace crumple::lab::stability {

namespace {

struct Look {
  const char* name;
  const char* colour;
  const char* letter;
  int severity;
};
constexpr Look kLooks[kCellStates] = {{"stable", "#7fc8a9", "", 0},          {"drifting", "#f4dd7e", "d", 2},
                                      {"energy growing", "#f29b4b", "E", 3}, {"inverted for ever", "#c2506e", "i", 4},
                                      {"passed through", "#8862ad", "p", 4}, {"refused at load", "#c8c8c8", "r", 1},
                                      {"not finite", "#2b2b2b", "N", 5}};

// "at all dt", "at no dt", "from 1/240 to 1/15", "at 1/240, 1/15".
std::string stable_part(const Axis& axis, const std::vector<bool>& stable) {
  const int n = static_cast<int>(stable.size());
  int count = 0, first = -1, last = -1;
  for (int k = 0; k < n; ++k) {
    if (!stable[k]) continue;
    ++count;
    if (first < 0) first = k;
    last = k;
  }
  if (count == n) return "at every " + axis.name;
  if (count == 0) return "at no " + axis.name;
  const std::string unit = axis.unit.empty() ? "" : " " + axis.unit;
  if (count == 1) return text("at ", axis.name, " = ", label(axis, first), unit, " only");
  if (count == last - first + 1) {
    if (first == 0) return text("up to ", axis.name, " = ", label(axis, last), unit);
    if (last == n - 1) return text("from ", axis.name, " = ", label(axis, first), unit, " up");
    return text("for ", axis.name, " from ", label(axis, first), " to ", label(axis, last), unit);
  }
  std::string list;
  for (int k = 0; k < n; ++k)
    if (stable[k]) list += (list.empty() ? "" : ", ") + label(axis, k);
  return text("at ", axis.name, " = ", list, unit);
}

}  // namespace

const char* name_of(CellState state) { return kLooks[static_cast<int>(state)].name; }
const char* colour_of(CellState state) { return kLooks[static_cast<int>(state)].colour; }
const char* letter_of(CellState state) { return kLooks[static_cast<int>(state)].letter; }
int severity(CellState state) { return kLooks[static_cast<int>(state)].severity; }

std::string label(const Axis& axis, int k) {
  const double value = axis.values[k];
  if (axis.unit == "s" && value < 1) return text("1/", std::lround(1 / value));
  return text(value);
}

std::vector<const Method*> HeatMap::methods() const {
  std::vector<const Method*> list;
  for (const Method* method : methods_of(family))
    if (method->mapped && (!iterating_only || method->fem.iterates)) list.push_back(method);
  return list;
}

std::string boundary_in_words(const HeatMap& map, const CellGrid& cells) {
  const int nx = static_cast<int>(map.x.values.size()), ny = static_cast<int>(map.y.values.size());
  std::vector<std::vector<bool>> stable(nx, std::vector<bool>(ny));
  std::vector<int> count(kCellStates, 0);
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j) {
      stable[i][j] = cells[j][i].state == CellState::stable;
      ++count[static_cast<int>(cells[j][i].state)];
    }
  if (count[0] == nx * ny) return "Stable in every cell: the boundary lies outside this map.";
  std::string words;
  if (count[0] == 0)
    words = "Stable in no cell";
  else
    for (int i = 0; i < nx;) {
      int end = i;
      while (end < nx && stable[end] == stable[i]) ++end;
      const std::string unit = map.x.unit.empty() ? "" : " " + map.x.unit;
      const std::string range = end == i + 1 ? label(map.x, i) : label(map.x, i) + " to " + label(map.x, end - 1);
      words += text(words.empty() ? "Stable for " : "; for ", map.x.name, " = ", range, unit, " ",
                    stable_part(map.y, stable[i]));
      i = end;
    }
  std::string counts;
  for (int s = 0; s < kCellStates; ++s)
    if (count[s] > 0) counts += text(counts.empty() ? "" : ", ", count[s], " ", kLooks[s].name);
  return text(words, ". Of ", nx * ny, " cells: ", counts, ".");
}

}  // namespace crumple::lab::stability
