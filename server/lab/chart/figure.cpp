#include "server/lab/chart/figure.h"

#include "common/text.h"
#include "server/lab/chart/panel.h"
#include "server/lab/chart/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <numeric>
#include <set>
#include <sstream>

namespace crumple::lab::chart {
namespace {

static_assert(std::lcm(kColourCount, kPointShapes) == kMostCurves);

// Of the legend, which is drawn over the whole canvas, in pixels, as title and footer are.
struct LegendEntry {
  std::string name, colour;
  int shape;
};

std::string footer_labels(const Footer& footer, double width) {
  const char* style = " right font ',8' tc rgb '#888888'\n";
  return text("set label 2 ", quoted(footer.made_on), " at ", width - 8, ",22", style, "set label 3 ", quoted(footer.made_of), " at ", width - 8, ",10", style);
}

void draw_frame(const Canvas& canvas, const std::string& title, const std::vector<LegendEntry>& legend, int columns, const Footer& footer,
                std::ostringstream& out) {
  const double W = canvas.width(), H = canvas.height();
  out << "reset\nset lmargin at screen 0\nset rmargin at screen 1\nset bmargin at screen 0\nset tmargin at screen 1\n"
      << "set xrange [0:" << W << "]\nset yrange [0:" << H << "]\nunset border\nunset tics\nunset key\nunset grid\n"
      << "set label 1 " << quoted(title) << " at " << kLeft - 50 << "," << H - 20 << " left font ',14' tc rgb '#111111'\n"
      << footer_labels(footer, W);
  const double top = canvas.panel_bottom() - kBottom;
  std::ostringstream plot;
  plot << "plot NaN";
  for (std::size_t k = 0; k < legend.size(); ++k) {
    const double x = kLeft + (W - kLeft - kRight) / columns * static_cast<double>(k % columns);
    const double y = top - kLegendRow * static_cast<double>(k / columns);
    out << "$legend" << k << " << EOD\n" << x << " " << y << "\nEOD\n";
    out << "set label " << 10 + k << " " << quoted(legend[k].name) << " at " << x + 12 << "," << y << " left font ',10' tc rgb '#333333'\n";
    plot << ", $legend" << k << " using 1:2 with points pt " << legend[k].shape << " ps 1 lw 1.8 lc rgb '" << legend[k].colour << "'";
  }
  out << plot.str() << "\n";
}

int shape_of(int k) {
  constexpr std::array<int, kPointShapes> shapes{7, 5, 9, 13, 11, 15, 6, 4, 8, 12, 10, 14};  // filled, then open
  return shapes[k % kPointShapes];
}

Mark mark(const Point& p, const std::string& x, const std::string& y) {
  Mark m{.x = p.median(x), .y = y == "value" ? p.value : p.median(y), .label = p.label, .failed = !p.failure.empty()};
  m.y_low = m.y_high = m.y;
  if (const auto at = p.measured.find(y); at != p.measured.end()) {
    m.y_low = at->second.q1;
    m.y_high = at->second.q3;
  }
  // A logarithmic axis knows no zero: exact agreement stands at a rounding's size.
  if (m.x == 0) m.x = 1e-16;
  if (m.y == 0) m.y = m.y_low = m.y_high = 1e-16;
  if (m.x > 1e3) m.x = 1e3;  // what diverged must not flatten the rest
  return m;
}

// The floor, 0 where it lies so far left of every point that it says nothing that the text does not.
double shown_floor(const std::vector<Point>& points) {
  double least = 1e300;
  for (const Point& p : points) {
    if (const double e = p.median("error"); e > 0) least = std::min(least, e);
  }
  const double floor = floors_of(points).common();
  return floor > least / 30 ? floor : 0;
}

Panel panel_of(const Study& study, const std::vector<Point>& points, const std::string& quantity, const std::string& axis) {
  Panel panel{.x_axis = study.error_axis, .y_axis = axis, .floor = shown_floor(points)};
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    Line line{.name = study.curves[c].name, .colour = static_cast<int>(c) % kColourCount, .shape = shape_of(static_cast<int>(c))};
    for (const Point& p : points) {
      if (p.curve == study.curves[c].name) line.marks.push_back(mark(p, "error", quantity));
    }
    if (quantity == "value" && study.curves[c].expected_order > 0) {
      line.expected_slope = 1 / study.curves[c].expected_order;
      line.slope_label = text("order ", study.curves[c].expected_order);
    }
    panel.lines.push_back(line);
  }
  return panel;
}

Figure finish(const Study& study, std::vector<Panel> panels, const std::vector<LegendEntry>& legend, const Footer& footer) {
  const int columns = std::max(1, static_cast<int>(panels.size() == 1 ? 2 : 3));
  const int rows = (static_cast<int>(legend.size()) + columns - 1) / columns;
  const Canvas canvas(static_cast<int>(panels.size()), rows);
  std::ostringstream out;
  out << "set multiplot\n";
  for (std::size_t k = 0; k < panels.size(); ++k) draw_panel(canvas, static_cast<int>(k), panels[k], out);
  draw_frame(canvas, study.title, legend, columns, footer, out);
  out << "unset multiplot\n";
  return {out.str(), static_cast<int>(canvas.width()), static_cast<int>(canvas.height())};
}

std::vector<LegendEntry> curve_legend(const Study& study) {
  std::vector<LegendEntry> legend;
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    legend.push_back({study.curves[c].name, kColours[c % kColourCount], shape_of(static_cast<int>(c))});
  }
  if (!study.peers.empty()) legend.push_back({"others, on their machine", "#000000", 3});
  return legend;
}

bool any_failed(const std::vector<Point>& points) {
  return std::any_of(points.begin(), points.end(), [](const Point& p) { return !p.failure.empty(); });
}

Figure work_precision(const Study& study, const std::vector<Point>& points, const Footer& footer) {
  std::vector<Panel> panels{panel_of(study, points, "seconds", study.cost_axis)};
  panels[0].real_time = study.real_time;
  panels[0].peers = study.peers;
  for (const PanelAxis& more : study.more) panels.push_back(panel_of(study, points, more.quantity, more.name));
  auto legend = curve_legend(study);
  if (any_failed(points)) legend.push_back({"X on the top edge: failed", "#444444", 2});
  if (panels[0].floor > 0) legend.push_back({"grey: the reference's own uncertainty", "#cccccc", 5});
  return finish(study, std::move(panels), legend, footer);
}

// Colour: the part of the error that is the largest. Shape: the mesh.
Figure pareto(const Study& study, const std::vector<Point>& points, const Footer& footer) {
  Panel panel{.x_axis = study.error_axis, .y_axis = study.cost_axis, .floor = shown_floor(points), .real_time = true, .labels = false};
  Panel iterations = panel;
  iterations.y_axis = "CG iterations a simulated second";
  iterations.real_time = false;
  const std::vector<std::string> parts{"solver", "time", "mesh"};
  std::vector<Offer> offers;
  for (const Point& p : points) offers.push_back(p.failure.empty() ? Offer{p.median("error"), p.median("seconds")} : Offer{std::nan(""), 0});
  for (std::size_t k : pareto_front(offers)) panel.front.emplace_back(offers[k].error, offers[k].cost);
  std::reverse(panel.front.begin(), panel.front.end());
  std::set<std::size_t> on_front;
  for (std::size_t k : pareto_front(offers)) on_front.insert(k);
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    for (std::size_t part = 0; part <= parts.size(); ++part) {
      Line line{.colour = part < parts.size() ? static_cast<int>(part) : 5, .shape = shape_of(static_cast<int>(c)), .joined = false};
      Line other = line;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const Point& p = points[k];
        if (p.curve != study.curves[c].name) continue;
        const std::string largest = dominating_part(p);
        if (largest != (part < parts.size() ? parts[part] : "")) continue;
        Mark m = mark(p, "error", "seconds");
        m.label = on_front.contains(k) ? text(p.curve, ", ", p.label) : "";
        line.marks.push_back(m);
        // Iterations a simulated second: of a step, times the steps in a second, which are seconds by ms a step.
        m.y = m.y_low = m.y_high = p.median("iterations") * 1000 * p.median("seconds") / p.median("ms_per_step");
        m.label.clear();
        other.marks.push_back(m);
      }
      if (line.marks.empty()) continue;
      panel.lines.push_back(line);
      iterations.lines.push_back(other);
    }
  }
  std::vector<LegendEntry> legend;
  for (std::size_t part = 0; part < parts.size(); ++part) legend.push_back({"largest part: " + parts[part] + " error", kColours[part], 5});
  for (std::size_t c = 0; c < study.curves.size(); ++c) legend.push_back({study.curves[c].name, "#777777", shape_of(static_cast<int>(c))});
  if (any_failed(points)) legend.push_back({"X on the top edge: failed", "#444444", 2});
  if (panel.floor > 0) legend.push_back({"grey: the reference's own uncertainty", "#cccccc", 5});
  panel.labels = true;
  iterations.labels = false;
  return finish(study, {panel, iterations}, legend, footer);
}

// The knob's value across; error or cost up.
Figure against_value(const Study& study, const std::vector<Point>& points, const Footer& footer) {
  const std::string quantity = study.kind == FigureKind::cost ? "seconds" : "error";
  Panel panel{.x_axis = study.value_axis, .y_axis = quantity == "error" ? study.error_axis : study.cost_axis};
  for (std::size_t c = 0; c < study.curves.size(); ++c) {
    const Curve& curve = study.curves[c];
    Line line{.name = curve.name, .colour = static_cast<int>(c) % kColourCount, .shape = shape_of(static_cast<int>(c))};
    for (const Point& p : points) {
      if (p.curve != curve.name) continue;
      Mark m = mark(p, "error", quantity);
      m.x = p.value;
      line.marks.push_back(m);
    }
    if (quantity == "error" && curve.expected_order > 0) {
      line.expected_slope = curve.expected_order;
      line.slope_label = text("order ", curve.expected_order);
    }
    panel.lines.push_back(line);
  }
  panel.real_time = quantity == "seconds" && study.real_time;
  return finish(study, {panel}, curve_legend(study), footer);
}

// A panel a statistic: median, a box from quartile to quartile, over the settings.
Figure ensemble(const Study& study, const std::vector<Point>& points, const Footer& footer) {
  constexpr double kWide = 290, kHigh = 190, kAcross = 96, kDown = 74;
  const int columns = 3, rows = (static_cast<int>(study.statistics.size()) + columns - 1) / columns;
  const double W = columns * (kWide + kAcross) + 20, H = kTop + rows * (kHigh + kDown) + kFooter;
  std::ostringstream out;
  out << std::setprecision(8) << "set multiplot\n";
  for (std::size_t s = 0; s < study.statistics.size(); ++s) {
    const std::string& name = study.statistics[s];
    std::string plain = name == "seconds" ? "wall s / simulated s" : name;
    for (char& c : plain) c = c == '_' ? ' ' : c;
    const double left = static_cast<double>(s % columns) * (kWide + kAcross) + kAcross - 6;
    const double top = H - kTop - static_cast<double>(s / columns) * (kHigh + kDown);
    out << "reset\nset lmargin at screen " << left / W << "\nset rmargin at screen " << (left + kWide) / W << "\nset tmargin at screen " << top / H
        << "\nset bmargin at screen " << (top - kHigh) / H << "\nunset key\nset border 3 lc rgb '#555555'\nset tics nomirror font ',9'\n"
        << "set grid ytics lc rgb '#e4e4e4'\nset ylabel " << quoted(plain) << " font ',11'\nset xtics rotate by -18 left font ',9'\n"
        << "set xrange [-0.6:" << static_cast<double>(points.size()) - 0.4 << "]\nset offsets 0,0,graph 0.1,0\nset yrange [0:*]\nset xtics (";
    for (std::size_t k = 0; k < points.size(); ++k) out << (k ? ", " : "") << quoted(points[k].label) << " " << k;
    out << ")\n$e" << s << " << EOD\n";
    double top_value = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto at = points[k].measured.find(name);
      if (at == points[k].measured.end() || std::isnan(at->second.median)) continue;
      out << k << " " << at->second.median << " " << at->second.q1 << " " << at->second.q3 << "\n";
      top_value = std::max(top_value, at->second.q3);
    }
    out << "EOD\n";
    if (name == "seconds") {
      int tag = 1;
      out << "set arrow 9 from graph 0, first 1 to graph 1, first 1 nohead dt 2 lc rgb '#777777'\n"
          << "set label 9 'real time' at graph 0.02, first 1 left offset 0,0.5 font ',8' tc rgb '#777777'\n";
      for (const PeerPoint& p : study.peers) {
        out << "set arrow " << 10 + tag << " from graph 0, first " << p.seconds << " to graph 1, first " << p.seconds << " nohead lc rgb '#000000'\n"
            << "set label " << 10 + tag << " " << quoted(p.name + " (others, their machine)") << " at graph 0.98, first " << p.seconds
            << " right offset 0,0.5 font ',8' tc rgb '#000000'\n";
        ++tag;
        top_value = std::max(top_value, p.seconds);
      }
      out << "set yrange [0:" << 1.2 * std::max(top_value, 1.0) << "]\n";
    }
    out << "plot $e" << s << " using 1:2:3:4 with yerrorbars pt 7 ps 1 lw 7 lc rgb '#a9cfe0', $e" << s
        << " using 1:2 with points pt 7 ps 1 lc rgb '#0b6e99'\n";
  }
  out << "reset\nset lmargin at screen 0\nset rmargin at screen 1\nset bmargin at screen 0\nset tmargin at screen 1\nset xrange [0:" << W
      << "]\nset yrange [0:" << H << "]\nunset border\nunset tics\nunset key\nset label 1 " << quoted(study.title + "   (point: median, bar: quartiles of the seeds)")
      << " at 20," << H - 20 << " left font ',14'\n" << footer_labels(footer, W) << "plot NaN\nunset multiplot\n";
  return {out.str(), static_cast<int>(W), static_cast<int>(H)};
}

// Feeds a program to gnuplot; the exit status says whether all of it was understood.
bool run_gnuplot(const std::string& program) {
  FILE* pipe = popen("gnuplot", "w");
  if (!pipe) return false;
  const bool written = std::fwrite(program.data(), 1, program.size(), pipe) == program.size();
  return pclose(pipe) == 0 && written;
}

}  // namespace

Result<void> find_gnuplot() {
  FILE* pipe = popen("gnuplot --version 2>/dev/null", "r");
  char line[128] = {};
  const bool answered = pipe && std::fgets(line, sizeof line, pipe);
  if (pipe) pclose(pipe);
  if (answered && std::string(line).starts_with("gnuplot")) return {};
  return std::unexpected(Error{ErrorCode::failed_precondition, "gnuplot", "was not found; charts are drawn with it (Debian: apt-get install gnuplot-nox)"});
}

Figure figure(const Study& study, const std::vector<Point>& points, const Footer& footer) {
  switch (study.kind) {
    case FigureKind::pareto: return pareto(study, points, footer);
    case FigureKind::against_value:
    case FigureKind::cost: return against_value(study, points, footer);
    case FigureKind::ensemble: return ensemble(study, points, footer);
    case FigureKind::work_precision: break;
  }
  return work_precision(study, points, footer);
}

Result<void> draw(const Figure& figure, const std::filesystem::path& folder, const std::string& name) {
  std::string plain = name;  // ids of an SVG, which share a page, may have letters and digits
  std::replace(plain.begin(), plain.end(), '-', '_');
  for (const char* kind : {"svg", "png"}) {
    const std::string file = (folder / (name + "." + kind)).string();
    // gnuplot would draw onto standard output instead.
    if (!std::ofstream(file)) return invalid(file, "cannot be written");
    std::ostringstream program;
    if (std::string(kind) == "svg") {
      program << "set terminal svg size " << figure.width << "," << figure.height << " dynamic noenhanced font 'Arial,12' name 'fig_" << plain
              << "' background rgb 'white'\n";
    } else {
      program << "set terminal pngcairo size " << figure.width << "," << figure.height << " noenhanced font 'Arial,10' background rgb 'white'\n";
    }
    program << "set output " << quoted(file) << "\n" << figure.program << "unset output\n";
    if (!run_gnuplot(program.str())) return std::unexpected(Error{ErrorCode::internal, file, "could not be drawn by gnuplot"});
  }
  return {};
}

}  // namespace crumple::lab::chart
