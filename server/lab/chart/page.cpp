#include "server/lab/chart/page.h"

#include "common/text.h"
#include "server/lab/chart/verdict.h"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace crumple::lab::chart {
namespace {

constexpr const char* kStyle = R"(
body { font: 16px/1.55 Georgia, 'Times New Roman', serif; color: #222; background: #fff; max-width: 1180px; margin: 2.5rem auto; padding: 0 1.2rem; }
h1, h2, nav, table, summary, .small { font-family: 'Helvetica Neue', Arial, sans-serif; }
h1 { font-size: 2rem; margin-bottom: .2rem; } h2 { font-size: 1.3rem; margin-top: 3.2rem; border-top: 1px solid #ddd; padding-top: 1.2rem; }
p { max-width: 46rem; } .small { color: #666; font-size: .85rem; } .conclusion { border-left: 4px solid #0b6e99; padding-left: 1rem; }
nav ol { columns: 2; font-size: .95rem; } nav a { color: #0b6e99; text-decoration: none; } nav a:hover { text-decoration: underline; }
figure { margin: 1rem 0; overflow-x: auto; } figure svg { max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: .85rem; margin: .6rem 0; } th, td { padding: .25rem .7rem; border-bottom: 1px solid #eee; text-align: left; }
th { color: #555; font-weight: 600; } td.n { text-align: right; font-variant-numeric: tabular-nums; } .missed { color: #b00020; }
details { margin: .8rem 0; } summary { cursor: pointer; color: #0b6e99; font-size: .9rem; }
)";

// Quantities that a study may have measured beside the usual ones: columns of its table.
struct Column {
  const char *quantity, *head;
};
constexpr Column kMore[] = {{"error_max", "largest error over time"}, {"error_energy", "error in energy norm"}, {"energy_lost", "energy lost"},
                            {"ms_assemble", "ms a step: assemble"},   {"ms_solve", "solve"},                    {"ms_contact", "contact"},
                            {"ms_other", "other"}};

std::vector<Column> more_columns(const std::vector<Point>& points) {
  std::vector<Column> columns;
  for (const Column& c : kMore) {
    for (const Point& p : points) {
      if (!p.measured.contains(c.quantity)) continue;
      columns.push_back(c);
      break;
    }
  }
  return columns;
}

std::string number(double v) {
  if (std::isnan(v)) return "";
  std::ostringstream out;
  out << std::setprecision(3) << v;
  return out.str();
}

std::string point_table(const Study& study, const std::vector<Point>& points) {
  std::ostringstream out;
  out << "<details><summary>all " << points.size() << " points</summary><table><tr><th>curve</th><th>setting</th>";
  const bool ensemble = study.kind == FigureKind::ensemble;
  if (ensemble) {
    for (const std::string& name : study.statistics) out << "<th>" << escaped(name) << "</th>";
  } else {
    out << "<th>error</th><th>seconds, median</th><th>quartiles</th><th>iterations</th>";
  }
  const std::vector<Column> columns = more_columns(points);
  for (const Column& c : columns) out << "<th>" << c.head << "</th>";
  out << "<th>runs</th><th>failure</th></tr>\n";
  for (const Point& p : points) {
    out << "<tr><td>" << escaped(p.curve) << "</td><td>" << escaped(p.label) << "</td>";
    if (ensemble) {
      for (const std::string& name : study.statistics) {
        const auto at = p.measured.find(name);
        out << "<td class=n>" << (at == p.measured.end() ? "" : text(number(at->second.median), " (", number(at->second.q1), " - ", number(at->second.q3), ")")) << "</td>";
      }
    } else {
      const auto at = p.measured.find("seconds");
      out << "<td class=n>" << number(p.median("error")) << "</td><td class=n>" << number(p.median("seconds")) << "</td><td class=n>"
          << (at == p.measured.end() ? "" : text(number(at->second.q1), " - ", number(at->second.q3))) << "</td><td class=n>"
          << number(p.median("iterations")) << "</td>";
    }
    for (const Column& c : columns) out << "<td class=n>" << number(p.median(c.quantity)) << "</td>";
    out << "<td class=n>" << p.runs << "</td><td>" << escaped(p.failure) << "</td></tr>\n";
  }
  out << "</table></details>\n";
  return out.str();
}

// "No more than the scene needs": the cheapest setting that meets 10, 3 and 1 %, a row a scene.
void cheapest_row(const Drawn& d, const std::string& what, const std::string& quantity, const std::vector<Point>& points, std::ostringstream& out) {
  out << "<tr><td><a href=\"#" << d.study->name << "\">" << escaped(d.study->title) << "</a>" << escaped(what) << "</td>";
  for (const double limit : {0.1, 0.03, 0.01}) {
    const Point* p = cheapest(points, limit, quantity);
    out << "<td>";
    if (p) out << escaped(p->curve) << ", " << escaped(p->label) << "<br><b>" << as_seconds(p->median("seconds")) << "</b> " << (d.study->real_time ? "a second" : "a solve");
    else out << "nothing here";
    out << "</td>";
  }
  out << "</tr>\n";
}

std::string cheapest_table(const std::vector<Drawn>& drawn) {
  std::ostringstream out;
  out << "<table><tr><th>scene</th><th>10 %</th><th>3 %</th><th>1 %</th></tr>\n";
  for (const Drawn& d : drawn) {
    const bool fits = d.study->ranked && (d.study->kind == FigureKind::work_precision || d.study->kind == FigureKind::pareto);
    if (!fits || d.points.empty()) continue;
    if (d.study->scene_a_curve) {
      for (const Curve& curve : d.study->curves) {
        std::vector<Point> mine;
        for (const Point& p : d.points) {
          if (p.curve == curve.name) mine.push_back(p);
        }
        if (!mine.empty()) cheapest_row(d, ": " + curve.name, "error", mine, out);
      }
      continue;
    }
    cheapest_row(d, "", "error", d.points, out);
    if (d.points.front().measured.contains("error_motion")) cheapest_row(d, ", only where it goes", "error_motion", d.points, out);
  }
  out << "</table>\n";
  return out.str();
}

// The part of an SVG file that may stand inside HTML.
std::string inner_svg(const std::string& svg) {
  const auto at = svg.find("<svg");
  return at == std::string::npos ? "" : svg.substr(at);
}

std::string few_points(const Study& study, const std::vector<Point>& points) {
  std::ostringstream out;
  for (const Curve& curve : study.curves) {
    int count = 0;
    for (const Point& p : points) count += p.curve == curve.name;
    if (count >= 5) continue;
    const std::string why = curve.why_few.empty() ? "the quick run leaves the others out" : curve.why_few;
    out << " " << escaped(curve.name) << ": " << count << (count == 1 ? " point" : " points") << ", since " << escaped(why) << ".";
  }
  return out.str();
}

// A study that was interrupted, or has got settings since it was measured.
std::string incomplete(const Study& study, const std::vector<Point>& points) {
  std::size_t wanted = 0;
  const bool quick = is_quick(points.front());
  for (const Curve& curve : study.curves) {
    for (const KnobValue& value : curve.knob.values) wanted += !(quick && value.heavy);
  }
  if (points.size() >= wanted) return "";
  return text(" Only ", points.size(), " of ", wanted, " settings have been measured at this commit.");
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string page(const std::vector<Drawn>& drawn, const std::vector<NotBuilt>& not_built, const std::string& head) {
  std::ostringstream out;
  out << "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">"
      << "<title>Crumple: what a millisecond buys</title><style>" << kStyle << "</style></head><body>\n"
      << "<h1>What a millisecond buys</h1>\n<p class=small>" << escaped(head) << "</p>\n"
      << "<p>Each figure sets an error against what it costs. Lower left is best. Both axes are logarithmic; the dashed line is real time; bars are the "
      << "quartiles of repeated runs; an X on the top edge is a setting that failed; nothing left of the grey counts, since there the reference itself is "
      << "unsure. Errors are split before they are summed: solver, time step, mesh, law, contact, precision and wire each have a figure.</p>\n<nav><ol>\n";
  out << "<li><a href=\"#cheapest\">The cheapest setting that is good enough</a></li>\n";
  const auto shown = [](const Drawn& d) { return !d.points.empty() || !d.study->unmet.empty(); };
  std::string left_out;
  for (const Drawn& d : drawn) {
    if (shown(d)) out << "<li><a href=\"#" << d.study->name << "\">" << escaped(d.study->title) << "</a></li>\n";
    else left_out += (left_out.empty() ? "" : ", ") + d.study->name;
  }
  out << "<li><a href=\"#not-built\">Not built yet</a></li></ol></nav>\n"
      << (left_out.empty() ? "" : "<p class=small>Not measured yet: " + escaped(left_out) + ".</p>\n")
      << "<h2 id=cheapest>The cheapest setting that is good enough</h2>\n<p>Wall time for a simulated second, or of a solve, of settings that stay within an "
      << "error. Where that is a rigid or an example-based body, it stands here; scenes where neither stands were run with finite elements only.</p>\n"
      << cheapest_table(drawn);
  for (const Drawn& d : drawn) {
    if (!shown(d)) continue;
    out << "<h2 id=\"" << d.study->name << "\">" << escaped(d.study->title) << "</h2>\n<p><b>Scene.</b> " << escaped(d.study->scene)
        << " <b>Compared with.</b> " << escaped(d.study->reference) << "</p>\n";
    if (!d.svg.empty()) out << "<figure>" << inner_svg(d.svg) << "</figure>\n";
    std::string words = escaped(conclusion(*d.study, d.points));
    for (std::size_t at = 0; (at = words.find("MISSED", at)) != std::string::npos; at += 30) words.replace(at, 6, "<b class=missed>missed</b>");
    out << "<p class=conclusion>" << words << "</p>\n";
    if (d.points.empty()) continue;
    if (const std::string few = few_points(*d.study, d.points); !few.empty()) out << "<p class=small>Fewer than five points." << few << "</p>\n";
    out << point_table(*d.study, d.points);
    out << "<p class=small>Scene " << escaped(d.points.front().scene_hash) << ", commit " << escaped(d.points.front().commit) << ", "
        << escaped(d.points.front().machine) << "." << escaped(incomplete(*d.study, d.points)) << "</p>\n";
  }
  out << "<h2 id=\"not-built\">Not built yet</h2>\n<p>What the curves could also show and cannot, since it does not exist here:</p>\n<ul>\n";
  for (const NotBuilt& n : not_built) out << "<li>" << escaped(n.what) << " - " << escaped(n.why) << "</li>\n";
  out << "</ul>\n</body></html>\n";
  return out.str();
}

}  // namespace crumple::lab::chart
