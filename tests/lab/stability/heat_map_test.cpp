#include "server/lab/stability/heat_map.h"

#include <gtest/gtest.h>

#include <set>

namespace crumple::lab::stability {
namespace {

HeatMap small_map() {
  HeatMap map;
  map.x = {"E", "Pa", {1e3, 1e4, 1e5}};
  map.y = {"dt", "s", {1.0 / 240, 1.0 / 60, 1.0 / 15}};
  return map;
}

CellGrid grid(std::initializer_list<std::initializer_list<CellState>> rows) {
  CellGrid cells;
  for (const auto& row : rows) {
    cells.emplace_back();
    for (const CellState state : row) cells.back().push_back({state, ""});
  }
  return cells;
}

constexpr CellState S = CellState::stable, D = CellState::drifting, N = CellState::not_finite;

TEST(HeatMap, SaysItsBoundaryInWords) {
  EXPECT_EQ(boundary_in_words(small_map(), grid({{S, S, S}, {S, S, D}, {N, N, N}})),
            "Stable for E = 1000 to 10000 Pa up to dt = 1/60 s; for E = 100000 Pa at dt = 1/240 s only. Of 9 cells: 5 "
            "stable, 1 drifting, 3 not finite.");
  EXPECT_EQ(boundary_in_words(small_map(), grid({{N, S, S}, {S, S, S}, {S, S, N}})),
            "Stable for E = 1000 Pa from dt = 1/60 s up; for E = 10000 Pa at every dt; for E = 100000 Pa up to dt = "
            "1/60 s. Of 9 cells: 7 stable, 2 not finite.");
  EXPECT_EQ(boundary_in_words(small_map(), grid({{S, S, S}, {S, S, S}, {S, S, S}})),
            "Stable in every cell: the boundary lies outside this map.");
  EXPECT_EQ(boundary_in_words(small_map(), grid({{N, N, N}, {N, N, N}, {N, N, N}})),
            "Stable in no cell. Of 9 cells: 9 not finite.");
}

TEST(HeatMap, TheSevenHaveAscendingAxesAndMethods) {
  std::set<std::string> keys;
  for (const HeatMap& map : all_maps()) {
    EXPECT_TRUE(keys.insert(map.key).second);
    EXPECT_FALSE(map.methods().empty()) << map.key;
    EXPECT_TRUE(std::ranges::is_sorted(map.x.values)) << map.key;
    EXPECT_TRUE(std::ranges::is_sorted(map.y.values)) << map.key;
  }
  EXPECT_EQ(keys, (std::set<std::string>{"E-dt", "nu-dt", "sliver-dt", "cap-E", "mass-dt", "speed-thickness",
                                         "impulse-gamma"}));
}

TEST(HeatMap, KnowsInstabilityWhereItIsKnown) {
  const auto cell = [](const std::string& key, const char* method, double x, double y) {
    const auto map = std::ranges::find(all_maps(), key, &HeatMap::key);
    return map->trial(*find_method(method), x, y).state;
  };
  EXPECT_EQ(cell("E-dt", "explicit", 1e6, 1.0 / 60), CellState::not_finite);  // far above 2 / omega_max
  EXPECT_EQ(cell("E-dt", "svd", 1e6, 1.0 / 60), CellState::stable);
  EXPECT_EQ(cell("sliver-dt", "svd", 1e-14, 1.0 / 60), CellState::refused);
  EXPECT_EQ(cell("speed-thickness", "raw-1e6", 1000, 0.01), CellState::passed);
  EXPECT_EQ(cell("speed-thickness", "rigid", 1000, 0.01), CellState::stable);
}

}  // namespace
}  // namespace crumple::lab::stability
