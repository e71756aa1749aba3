#include "server/lab/stability/baseline.h"

#include "common/text.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace crumple::lab::stability {

using Json = nlohmann::json;

namespace {

constexpr double kMargin = 1.5;  // of a limit's value: other compilers round differently, chaos amplifies it
constexpr double kNoise = 1e-6;  // values below it are rounding
constexpr int kPairs = 3;        // a map and method

std::string row_text(const RowKey& key) { return text(key.first, " ", key.second); }
std::string cell_text(const CellKey& key) { return text(key.map, " ", key.method, " ", key.i, " ", key.j); }

std::string row_title(const RowKey& key) {
  const auto row = std::ranges::find(all_rows(), key.first, &Row::number);
  return text("row ", key.first, ", ", row->name, ", ", find_method(key.second)->name);
}

std::string cell_title(const CellKey& key) {
  const auto map = std::ranges::find(all_maps(), key.map, &HeatMap::key);
  return text("map ", key.map, ", ", find_method(key.method)->name, ", ", map->x.name, " = ", label(map->x, key.i),
              ", ", map->y.name, " = ", label(map->y, key.j));
}

bool exists(const RowKey& key) {
  const auto row = std::ranges::find(all_rows(), key.first, &Row::number);
  const Method* method = find_method(key.second);
  return row != all_rows().end() && method && method->family == row->family;
}

bool exists(const CellKey& key) {
  const auto map = std::ranges::find(all_maps(), key.map, &HeatMap::key);
  const Method* method = find_method(key.method);
  return map != all_maps().end() && method && method->family == map->family && key.i >= 0 && key.j >= 0 &&
         key.i < static_cast<int>(map->x.values.size()) && key.j < static_cast<int>(map->y.values.size());
}

bool parse_state(const std::string& name, CellState& state) {
  for (int s = 0; s < kCellStates; ++s) {
    if (name != name_of(static_cast<CellState>(s))) continue;
    state = static_cast<CellState>(s);
    return true;
  }
  return false;
}

}  // namespace

Json to_json(const Baseline& baseline) {
  Json json{{"rows", Json::object()}, {"cells", Json::object()}};
  for (const auto& [key, outcome] : baseline.rows)
    json["rows"][row_text(key)] = {{"verdict", name_of(outcome.verdict)}, {"value", outcome.value}};
  for (const auto& [key, state] : baseline.cells) json["cells"][cell_text(key)] = name_of(state);
  return json;
}

bool from_json(const Json& json, Baseline& baseline, std::string& error) {
  if (!json.is_object() || !json.contains("rows") || !json.contains("cells") || !json["rows"].is_object() ||
      !json["cells"].is_object()) {
    error = "must be an object of rows and cells";
    return false;
  }
  for (const auto& [name, entry] : json["rows"].items()) {
    std::istringstream in(name);
    RowKey key;
    Outcome outcome;
    const bool well = (in >> key.first >> key.second) && exists(key) && entry.is_object() &&
                      entry.contains("verdict") && entry["verdict"].is_string() &&
                      parse(entry["verdict"], outcome.verdict);
    if (!well) {
      error = text("rows[\"", name, "\"] is no outcome of a row and method that exist");
      return false;
    }
    outcome.value = entry.contains("value") && entry["value"].is_number() ? entry["value"].get<double>() : std::nan("");
    baseline.rows[key] = outcome;
  }
  for (const auto& [name, entry] : json["cells"].items()) {
    std::istringstream in(name);
    CellKey key;
    CellState state;
    if (!(in >> key.map >> key.method >> key.i >> key.j) || !exists(key) || !entry.is_string() ||
        !parse_state(entry, state)) {
      error = text("cells[\"", name, "\"] is no state of a cell that exists");
      return false;
    }
    baseline.cells[key] = state;
  }
  return true;
}

std::vector<CellKey> boundary_cells(const Survey& full, double budget) {
  const auto stable = [&](const CellKey& key) { return full.cells.at(key).cell.state == CellState::stable; };
  struct Pair {
    double seconds;
    CellKey a, b;
  };
  std::vector<std::vector<Pair>> candidates;  // of each map and method, cheapest first
  for (const HeatMap& map : all_maps())
    for (const Method* method : map.methods()) {
      std::vector<Pair> pairs;
      const int nx = static_cast<int>(map.x.values.size()), ny = static_cast<int>(map.y.values.size());
      const auto add = [&](const CellKey& a, const CellKey& b) {
        if (!full.cells.contains(a) || !full.cells.contains(b)) return;
        pairs.push_back({full.cells.at(a).seconds + full.cells.at(b).seconds, a, b});
      };
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
          const CellKey here{map.key, method->key, i, j}, right{map.key, method->key, i + 1, j},
              above{map.key, method->key, i, j + 1};
          if (!full.cells.contains(here)) continue;
          if (i + 1 < nx && full.cells.contains(right) && stable(here) != stable(right)) add(here, right);
          if (j + 1 < ny && full.cells.contains(above) && stable(here) != stable(above)) add(here, above);
        }
      if (pairs.empty()) add({map.key, method->key, nx - 1, ny - 1}, {map.key, method->key, 0, ny - 1});
      std::ranges::stable_sort(pairs, {}, &Pair::seconds);
      candidates.push_back(std::move(pairs));
    }
  std::set<CellKey> chosen;
  double spent = 0;
  for (int round = 0; round < kPairs; ++round)
    for (const auto& pairs : candidates) {
      if (round >= static_cast<int>(pairs.size()) || spent + pairs[round].seconds > budget) continue;
      spent += pairs[round].seconds;
      chosen.insert(pairs[round].a);
      chosen.insert(pairs[round].b);
    }
  return {chosen.begin(), chosen.end()};
}

Comparison compare(const Baseline& baseline, const Survey& now) {
  Comparison result;
  for (const auto& [key, before] : baseline.rows) {
    const auto at = now.rows.find(key);
    if (at == now.rows.end()) {
      result.inward.push_back(row_title(key) + ": was not run");
      continue;
    }
    const Outcome& after = at->second.outcome;
    const std::string change = text(": ", name_of(before.verdict), " (", before.value, ") became ",
                                    name_of(after.verdict), " (", after.value, "): ", after.text);
    if (is_worse(after.verdict, before.verdict) ||
        (after.verdict == Verdict::not_built && before.verdict != Verdict::not_built))
      result.inward.push_back(row_title(key) + change);
    else if (is_worse(before.verdict, after.verdict) || before.verdict != after.verdict)
      result.outward.push_back(row_title(key) + change);
    else if (before.verdict == Verdict::limit && after.value > kMargin * before.value + kNoise)
      result.inward.push_back(row_title(key) + change);
    else if (before.verdict == Verdict::limit && kMargin * after.value + kNoise < before.value)
      result.outward.push_back(row_title(key) + change);
  }
  for (const auto& [key, before] : baseline.cells) {
    const auto at = now.cells.find(key);
    if (at == now.cells.end()) {
      result.inward.push_back(cell_title(key) + ": was not run");
      continue;
    }
    const Cell& after = at->second.cell;
    const std::string change = text(": ", name_of(before), " became ", name_of(after.state), ": ", after.note);
    if (severity(after.state) > severity(before)) result.inward.push_back(cell_title(key) + change);
    if (severity(after.state) < severity(before)) result.outward.push_back(cell_title(key) + change);
  }
  return result;
}

}  // namespace crumple::lab::stability
