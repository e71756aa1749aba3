#include "server/lab/stability/stability_command.h"

#include "common/text.h"
#include "server/lab/stability/baseline.h"
#include "server/lab/stability/report.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <fstream>
#include <iostream>

namespace crumple::lab::stability {

namespace {

using Json = nlohmann::json;

constexpr double kBoundaryBudget = 20;  // of the regression part's cells [s]

struct Command {
  std::string out, only, baseline, write_baseline, references = "../shared/yardstick";
  bool ci = false;

  int run() const;
  bool asked(const RowKey& key) const { return only.empty() || text(key.first) == only; }
  bool asked(const CellKey& key) const { return only.empty() || key.map == only; }
  int fail(const std::string& message, int code) const {
    std::cerr << "crumple-lab: " << message << "\n";
    return code;
  }
  int run_only() const;
  int run_ci() const;
  int run_full() const;
};

Json summary(const Survey& survey) {
  Json counts{{"pass", 0}, {"limit", 0}, {"fails", 0}, {"not built", 0}};
  for (const auto& [key, result] : survey.rows)
    counts[name_of(result.outcome.verdict)] = counts[name_of(result.outcome.verdict)].get<int>() + 1;
  return {{"rows", all_rows().size()}, {"outcomes", counts}, {"cells", survey.cells.size()}};
}

int Command::run() const {
  if (ci) return run_ci();
  if (!only.empty()) return run_only();
  if (out.empty()) return fail("--out is missing, must name a folder for the report", 2);
  return run_full();
}

int Command::run_only() const {
  Plan plan = full_plan(references);
  std::erase_if(plan.rows, [&](const RowKey& key) { return !asked(key); });
  std::erase_if(plan.cells, [&](const CellKey& key) { return !asked(key); });
  if (plan.rows.empty() && plan.cells.empty())
    return fail("--only is " + only + ", must be a row from 1 to 41 or a map", 2);
  const Survey survey = run_survey(plan, {});
  Json result = Json::object();
  for (const auto& [key, row] : survey.rows)
    result[key.second] = {{"verdict", name_of(row.outcome.verdict)},
                          {"value", row.outcome.value},
                          {"text", row.outcome.text},
                          {"seconds", row.seconds}};
  for (const HeatMap& map : all_maps())
    if (map.key == only)
      for (const Method* method : map.methods())
        result[method->key] = boundary_in_words(map, survey.grid(map, method->key));
  std::cout << result.dump() << "\n";
  return 0;
}

int Command::run_ci() const {
  if (baseline.empty()) return fail("--baseline is missing, must name the file of known outcomes", 2);
  std::ifstream in(baseline);
  Baseline known;
  std::string error;
  if (!in) return fail("--baseline is " + baseline + ", which cannot be read", 2);
  if (!from_json(Json::parse(in, nullptr, false), known, error)) return fail(baseline + ": " + error, 2);
  std::erase_if(known.rows, [&](const auto& row) { return !asked(row.first); });
  std::erase_if(known.cells, [&](const auto& cell) { return !asked(cell.first); });
  Plan plan{.effort = {.brief = true}, .rows = rows_of_brief()};
  std::erase_if(plan.rows, [&](const RowKey& key) { return !asked(key); });
  for (const auto& [key, state] : known.cells) plan.cells.push_back(key);
  const Survey survey = run_survey(plan, {});
  const Comparison comparison = compare(known, survey);
  Json result = summary(survey);
  result["inward"] = comparison.inward;
  result["outward"] = comparison.outward;
  std::cout << result.dump() << "\n";
  for (const std::string& line : comparison.inward) std::cerr << "fell behind: " << line << "\n";
  for (const std::string& line : comparison.outward)
    std::cerr << "better, the baseline may be raised: " << line << "\n";
  return comparison.inward.empty() ? 0 : 1;
}

int Command::run_full() const {
  std::error_code problem;
  std::filesystem::create_directories(out, problem);
  if (problem) return fail("--out is " + out + ", which cannot be made: " + problem.message(), 2);
  const std::filesystem::path dir(out), journal = dir / "unfinished.jsonl";
  if (!std::ofstream(journal, std::ios::app)) return fail("--out is " + out + ", which cannot be written", 2);
  const Survey survey = run_survey(full_plan(references), journal);
  write_tables(survey, dir);
  const auto figures = draw_maps(survey, dir);
  if (!figures) std::cerr << "crumple-lab: " << figures.error().text() << "; the page has no figures\n";
  write_page(survey, figures ? *figures : std::map<std::string, std::string>{}, dir);
  if (!write_baseline.empty()) {
    const Survey brief = run_survey({.effort = {.brief = true}, .rows = rows_of_brief()}, {});
    Baseline known;
    for (const auto& [key, result] : brief.rows) known.rows[key] = result.outcome;
    for (const CellKey& key : boundary_cells(survey, kBoundaryBudget))
      known.cells[key] = survey.cells.at(key).cell.state;
    std::ofstream(write_baseline) << to_json(known).dump(1) << "\n";
  }
  if (figures) std::filesystem::remove(journal, problem);
  std::cout << summary(survey).dump() << "\n";
  return figures ? 0 : 1;
}

}  // namespace

void add_command(CLI::App& app, int& exit_code) {
  auto command = std::make_shared<Command>();
  auto* s = app.add_subcommand(
      "stability", "where each method fails: 41 checks and seven maps into a report, or their regression part");
  s->add_option("--out", command->out, "folder of the report; an interrupted run goes on there");
  s->add_flag("--ci", command->ci, "the regression part: compares with --baseline, exit 1 if something fell behind");
  s->add_option("--baseline", command->baseline, "known outcomes");
  s->add_option("--write-baseline", command->write_baseline, "after a full run: known outcomes anew");
  s->add_option("--references", command->references,
                "folder of reference cases; a row that wants a mesh of it says so where it is not there")
      ->capture_default_str();
  s->add_option("--only", command->only, "one row, or one map by its key; prints, writes nothing");
  s->callback([command, &exit_code] { exit_code = command->run(); });
}

}  // namespace crumple::lab::stability
