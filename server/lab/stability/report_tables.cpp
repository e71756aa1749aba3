#include "server/lab/stability/report.h"

#include "common/text.h"

#include <fstream>

namespace crumple::lab::stability {

namespace {

std::string quoted(const std::string& field) {
  std::string out = "\"";
  for (const char c : field) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

}  // namespace

void write_tables(const Survey& survey, const std::filesystem::path& dir) {
  std::ofstream rows(dir / "rows.csv");
  rows << "row,name,method,standing,verdict,value,slowest_step,text\n";
  for (const Row& row : all_rows()) {
    for (const Method* method : methods_of(row.family)) {
      const auto at = survey.rows.find({row.number, method->key});
      if (at == survey.rows.end()) continue;
      const Outcome& outcome = at->second.outcome;
      rows << row.number << "," << quoted(row.name) << "," << method->key << "," << name_of(method->standing) << ","
           << name_of(outcome.verdict) << "," << outcome.value << "," << at->second.slowest_step << ","
           << quoted(outcome.text) << "\n";
    }
    for (const Missing& missing : row.not_built)
      rows << row.number << "," << quoted(row.name) << "," << quoted(missing.method) << ",,not built,,,"
           << quoted(missing.what) << "\n";
  }
  std::ofstream maps(dir / "maps.csv");
  maps << "map,method,x,y,state,note\n";
  for (const HeatMap& map : all_maps())
    for (const Method* method : map.methods())
      for (std::size_t j = 0; j < map.y.values.size(); ++j)
        for (std::size_t i = 0; i < map.x.values.size(); ++i) {
          const auto at = survey.cells.find({map.key, method->key, static_cast<int>(i), static_cast<int>(j)});
          if (at == survey.cells.end()) continue;
          maps << map.key << "," << method->key << "," << map.x.values[i] << "," << map.y.values[j] << ","
               << name_of(at->second.cell.state) << "," << quoted(at->second.cell.note) << "\n";
        }
}

}  // namespace crumple::lab::stability
