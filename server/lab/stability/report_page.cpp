#include "server/lab/stability/report.h"

#include "common/text.h"

#include <array>
#include <cmath>
#include <fstream>
#include <set>

namespace crumple::lab::stability {

namespace {

const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1320px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.7em; } h2 { margin-top: 2.2em; border-bottom: 1px solid #ccc; } h3 { margin-bottom: .2em; }
table { border-collapse: collapse; width: 100%; } td, th { vertical-align: top; text-align: left; padding: .45em .6em; border-top: 1px solid #ddd; }
td.n { text-align: right; color: #666; } .small { color: #555; font-size: .88em; }
ul.outcomes { list-style: none; margin: 0; padding: 0; } ul.outcomes li { margin-bottom: .35em; }
.chip { display: inline-block; min-width: 4.6em; text-align: center; border-radius: 3px; padding: 0 .4em; font-size: .82em; font-weight: 600; }
.pass { background: #cfeedd; color: #14532d; } .limit { background: #fbeeb8; color: #5f4700; }
.fails { background: #f3c4cf; color: #7a1029; } .not { background: #e4e4e4; color: #444; }
.standing { color: #777; font-size: .82em; } figure { margin: 1em 0 2em; overflow-x: auto; } figure svg { max-width: 100%; height: auto; }
)";

constexpr double kSlow = 3;  // slowest step over the median one that is worth a word (PASS-0)

std::string escaped(const std::string& plain) {
  std::string out;
  for (const char c : plain) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::string chip(Verdict verdict) {
  const char* kind = verdict == Verdict::pass    ? "pass"
                     : verdict == Verdict::limit ? "limit"
                     : verdict == Verdict::fails ? "fails"
                                                 : "not";
  return text("<span class=\"chip ", kind, "\">", name_of(verdict), "</span>");
}

void write_row(std::ostream& out, const Row& row, const Survey& survey) {
  out << "<tr id=\"row" << row.number << "\"><td class=\"n\">" << row.number << "</td><td><b>" << escaped(row.name)
      << "</b><br><span class=\"small\">" << escaped(row.test) << ".<br><i>Passes if:</i> " << escaped(row.criterion)
      << ".</span></td><td><ul class=\"outcomes\">\n";
  for (const Method* method : methods_of(row.family)) {
    const auto at = survey.rows.find({row.number, method->key});
    if (at == survey.rows.end()) continue;
    const Outcome& outcome = at->second.outcome;
    out << "<li>" << chip(outcome.verdict) << " <b>" << escaped(method->name) << "</b>";
    if (method->standing != Standing::offered)
      out << " <span class=\"standing\">" << (method->standing == Standing::paper ? "the paper's" : "for comparison")
          << "</span>";
    out << "<br><span class=\"small\">" << escaped(outcome.text);
    if (at->second.slowest_step > kSlow)
      out << text(". Slowest step ", std::round(10 * at->second.slowest_step) / 10, " times the median");
    out << "</span></li>\n";
  }
  for (const Missing& missing : row.not_built)
    out << "<li>" << chip(Verdict::not_built) << " <b>" << escaped(missing.method) << "</b><br><span class=\"small\">"
        << escaped(missing.what) << "</span></li>\n";
  out << "</ul></td></tr>\n";
}

void write_summary(std::ostream& out, const Survey& survey) {
  out << "<table style=\"max-width: "
         "46em\"><tr><th>method</th><th></th><th>pass</th><th>limit</th><th>fails</th><th>rows that fail</th></tr>\n";
  for (const Method& method : all_methods()) {
    std::array<int, 4> count{};
    std::string failing;
    for (const auto& [key, result] : survey.rows) {
      if (key.second != method.key) continue;
      ++count[static_cast<int>(result.outcome.verdict)];
      if (result.outcome.verdict == Verdict::fails)
        failing += text(" <a href=\"#row", key.first, "\">", key.first, "</a>");
    }
    out << "<tr><td>" << escaped(method.name) << "</td><td class=\"standing\">"
        << (method.standing == Standing::offered ? ""
            : method.standing == Standing::paper ? "the paper's"
                                                 : "for comparison")
        << "</td><td>" << count[0] << "</td><td>" << count[1] << "</td><td>" << count[2] << "</td><td>" << failing
        << "</td></tr>\n";
  }
  out << "</table>\n";
}

}  // namespace

void write_page(const Survey& survey, const std::map<std::string, std::string>& figures,
                const std::filesystem::path& dir) {
  std::ofstream out(dir / "index.html");
  out << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Crumple: where each method "
         "fails</title><style>"
      << kStyle << "</style></head><body>\n"
      << "<h1>Where each method fails</h1>\n"
      << "<p>41 failures that the literature knows, each with a stress test and a criterion, run for every method that "
         "a scene can ask for, for the raw forms of the two papers, and for "
         "methods that exist here only to show why they were not chosen. In every row the least is: no NaN, no crash, "
         "everything bounded. Where a step took more than three times the median one, and more than 3 ms of processor "
         "time, that is said beside the outcome and not part of it.</p>\n<p>"
      << chip(Verdict::pass) << " the criterion holds. " << chip(Verdict::limit)
      << " finite and bounded, but the criterion is missed: the number says by how much. " << chip(Verdict::fails)
      << " not finite, unbounded, crashed, or the failure of the row's name stays for ever. "
      << chip(Verdict::not_built) << " does not exist yet.</p>\n"
      << "<p class=\"small\">Made by <code>crumple-lab stability</code>, compiler " << escaped(__VERSION__)
      << ". Times are not judged: no verdict depends on how fast the machine is. All numbers are in "
         "rows.csv and maps.csv beside this page.</p>\n";
  write_summary(out, survey);
  out << "<h2>The rows</h2>\n<table>\n";
  for (const Row& row : all_rows()) write_row(out, row, survey);
  out << "</table>\n<h2>The maps</h2>\n";
  for (const HeatMap& map : all_maps()) {
    out << "<h3>" << escaped(map.title) << "</h3>\n<figure>" << (figures.contains(map.key) ? figures.at(map.key) : "")
        << "</figure>\n<p>" << escaped(map.meaning) << "</p>\n<p>";
    for (const Method* method : map.methods())
      out << "<b>" << escaped(method->name) << ".</b> "
          << escaped(boundary_in_words(map, survey.grid(map, method->key))) << "<br>\n";
    out << "</p>\n";
  }
  out << "</body></html>\n";
}

}  // namespace crumple::lab::stability
