#include "server/lab/stability/survey.h"

#include "server/lab/stability/isolated.h"
#include "server/lab/stability/progress_bar.h"
#include "server/lab/stability/step_times.h"

#include <cmath>
#include <fstream>

namespace crumple::lab::stability {

using Json = nlohmann::json;

namespace {

const Row& row_of(int number) {
  for (const Row& row : all_rows())
    if (row.number == number) return row;
  std::abort();  // a caller's bug
}

const HeatMap& map_of(const std::string& key) {
  for (const HeatMap& map : all_maps())
    if (map.key == key) return map;
  std::abort();  // a caller's bug
}

struct Job {
  std::string key;
  double weight = 0;  // seconds, roughly
  std::function<std::string()> work;
  std::function<void(const Json& answer, double seconds)> take;
};

Job row_job(const RowKey& key, const Effort& effort, Survey& survey) {
  const Row& row = row_of(key.first);
  const Method& method = *find_method(key.second);
  Job job{"row " + std::to_string(key.first) + " " + key.second, row.seconds * (effort.brief ? 0.15 : 1)};
  job.work = [&row, &method, effort] {
    StepTimes times;
    const Outcome outcome = row.check(method.timed(times), effort);
    return Json{{"verdict", name_of(outcome.verdict)},
                {"value", outcome.value},
                {"text", outcome.text},
                {"slowest", times.worst()}}
        .dump();
  };
  job.take = [key, &survey](const Json& answer, double seconds) {
    RowResult& result = survey.rows[key];
    result.seconds = seconds;
    if (answer.contains("crash")) {
      result.outcome = {Verdict::fails, std::nan(""), answer["crash"]};
      return;
    }
    parse(answer["verdict"], result.outcome.verdict);
    result.outcome.value = answer["value"].is_number() ? answer["value"].get<double>() : std::nan("");
    result.outcome.text = answer["text"];
    result.slowest_step = answer.value("slowest", 0.0);
  };
  return job;
}

Job cell_job(const CellKey& key, Survey& survey) {
  const HeatMap& map = map_of(key.map);
  const Method& method = *find_method(key.method);
  Job job{"cell " + key.map + " " + key.method + " " + std::to_string(key.i) + " " + std::to_string(key.j), 0.4};
  job.work = [&map, &method, key] {
    const Cell cell = map.trial(method, map.x.values[key.i], map.y.values[key.j]);
    return Json{{"state", static_cast<int>(cell.state)}, {"note", cell.note}}.dump();
  };
  job.take = [key, &survey](const Json& answer, double seconds) {
    CellResult& result = survey.cells[key];
    result.seconds = seconds;
    if (answer.contains("crash"))
      result.cell = {CellState::not_finite, answer["crash"]};
    else
      result.cell = {static_cast<CellState>(answer["state"].get<int>()), answer["note"]};
  };
  return job;
}

}  // namespace

CellGrid Survey::grid(const HeatMap& map, const std::string& method) const {
  CellGrid grid(map.y.values.size(), std::vector<Cell>(map.x.values.size()));
  for (const auto& [key, result] : cells)
    if (key.map == map.key && key.method == method) grid[key.j][key.i] = result.cell;
  return grid;
}

Plan full_plan(const std::filesystem::path& references) {
  Plan plan{.effort = {.references = references}};
  for (const Row& row : all_rows())
    for (const Method* method : methods_of(row.family)) plan.rows.emplace_back(row.number, method->key);
  for (const HeatMap& map : all_maps())
    for (const Method* method : map.methods())
      for (int j = 0; j < static_cast<int>(map.y.values.size()); ++j)
        for (int i = 0; i < static_cast<int>(map.x.values.size()); ++i)
          plan.cells.push_back({map.key, method->key, i, j});
  return plan;
}

std::vector<RowKey> rows_of_brief() {
  std::vector<RowKey> keys;
  for (const Row& row : all_rows())
    if (row.in_brief)
      for (const Method* method : methods_of(row.family)) keys.emplace_back(row.number, method->key);
  return keys;
}

Survey run_survey(const Plan& plan, const std::filesystem::path& journal) {
  Survey survey;
  std::vector<Job> jobs;
  for (const RowKey& key : plan.rows) jobs.push_back(row_job(key, plan.effort, survey));
  for (const CellKey& key : plan.cells) jobs.push_back(cell_job(key, survey));

  std::map<std::string, Json> done;
  if (!journal.empty()) {
    std::ifstream in(journal);
    for (std::string line; std::getline(in, line);) {
      const Json entry = Json::parse(line, nullptr, false);
      if (entry.is_object() && entry.contains("key") && entry.contains("answer") && entry.contains("seconds"))
        done[entry["key"]] = entry;
    }
  }
  std::ofstream out;
  if (!journal.empty()) out.open(journal, std::ios::app);
  double total = 0;
  for (const Job& job : jobs)
    if (!done.contains(job.key)) total += job.weight;
  ProgressBar progress(total);
  for (const Job& job : jobs) {
    if (const auto at = done.find(job.key); at != done.end()) {
      job.take(at->second["answer"], at->second["seconds"]);
      continue;
    }
    progress.show(job.key);
    const Isolated run = run_isolated(job.work);
    Json answer = Json::parse(run.answer, nullptr, false);
    if (!run.finished || !answer.is_object()) answer = {{"crash", run.ending.empty() ? "no answer" : run.ending}};
    job.take(answer, run.seconds);
    if (out.is_open()) out << Json{{"key", job.key}, {"seconds", run.seconds}, {"answer", answer}}.dump() << std::endl;
    progress.advance(job.weight);
  }
  progress.finish();
  return survey;
}

}  // namespace crumple::lab::stability
