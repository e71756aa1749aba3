#include "server/lab/chart/panel.h"

#include "common/text.h"
#include "server/lab/chart/labels.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <set>

namespace crumple::lab::chart {
namespace {

// A logarithmic axis from a little below the least to a little above the most.
struct Axis {
  double low = 1e300, high = 0;
  void take(double v) {
    if (!(v > 0) || !std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void close() {
    if (high == 0) low = high = 1;
    low /= 1.8;
    high *= 1.8;
    // Two decades at least, so that ticks have numbers.
    while (std::log10(high / low) < 1.6) {
      low /= 1.3;
      high *= 1.3;
    }
  }
  double at(double v) const { return std::log(std::clamp(v, low, high) / low) / std::log(high / low); }
};

// A number a decade, or 1, 2 and 5 of each where decades are few, or each second or third where they are many.
std::string ticks(const char* axis, const Axis& a) {
  const double decades = std::log10(a.high / a.low);
  const int every = static_cast<int>(std::ceil(decades / 7));
  std::ostringstream out;
  out << "set " << axis << "tics font ',10' (";
  const char* comma = "";
  for (int k = static_cast<int>(std::floor(std::log10(a.low))); k <= std::log10(a.high); ++k) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double v = digit * std::pow(10.0, k);
      if (v < a.low || v > a.high) continue;
      const bool numbered = digit == 1 ? k % every == 0 : decades < 2.5 && (digit == 2 || digit == 5);
      if (!numbered && decades > 4 && digit != 1) continue;
      out << comma << (numbered ? quoted(text(v)) : "''") << " " << std::setprecision(12) << v << (numbered ? " 0" : " 1");
      comma = ", ";
    }
  }
  out << ")\n";
  return out.str();
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (char c : text) out += c == '\'' ? std::string("''") : std::string(1, c == '\n' ? ' ' : c);
  return out + "'";
}

void draw_panel(const Canvas& canvas, int index, const Panel& panel, std::ostringstream& out) {
  Axis x, y;
  for (const Line& line : panel.lines) {
    for (const Mark& m : line.marks) {
      if (m.failed && !(m.x < 10)) continue;
      x.take(m.x);
      if (!m.failed) {
        y.take(m.y);
        y.take(m.y_low);
        y.take(m.y_high);
      }
    }
  }
  for (const PeerPoint& p : panel.peers) {
    x.take(p.error);
    y.take(p.seconds);
  }
  if (panel.floor > 0) x.take(panel.floor);
  if (panel.real_time) y.take(1);
  x.close();
  y.close();
  const double left = canvas.panel_left(index), bottom = canvas.panel_bottom();
  out << std::setprecision(8);
  out << "reset\nset lmargin at screen " << canvas.x(left) << "\nset rmargin at screen " << canvas.x(left + canvas.panel_width())
      << "\nset bmargin at screen " << canvas.y(bottom) << "\nset tmargin at screen " << canvas.y(bottom + kPanelHeight) << "\n"
      << "set logscale xy\nset xrange [" << x.low << ":" << x.high << "]\nset yrange [" << y.low << ":" << y.high << "]\n"
      << ticks("x", x) << ticks("y", y) << "set grid xtics ytics lc rgb '#e4e4e4' lw 1\nset border 3 lc rgb '#555555'\nset tics nomirror\n"
      << "unset key\nset xlabel " << quoted(panel.x_axis) << " font ',11'\nset ylabel " << quoted(panel.y_axis) << " font ',11' offset 0.5,0\n";
  if (panel.floor > x.low) {
    out << "set object 1 rectangle from graph 0, graph 0 to first " << panel.floor
        << ", graph 1 behind fc rgb '#ececec' fs solid noborder\n";
  }
  if (panel.real_time) {
    out << "set arrow 900 from graph 0, first 1 to graph 1, first 1 nohead dt 2 lw 1.5 lc rgb '#777777'\n"
        << "set label 901 'real time' at graph 0.99, first 1 right offset 0,0.5 font ',9' tc rgb '#777777'\n";
    // What a scene of many such bodies can give to one.
    constexpr double kShare = 1.0 / 60;
    if (y.low < kShare && kShare < y.high) {
      out << "set arrow 902 from graph 0, first " << kShare << " to graph 1, first " << kShare << " nohead dt 3 lw 1 lc rgb '#aaaaaa'\n"
          << "set label 903 '1/60 of it' at graph 0.99, first " << kShare << " right offset 0,0.5 font ',8' tc rgb '#aaaaaa'\n";
    }
  }

  // Labels, in pixels of the panel.
  LabelPlacer placer(canvas.panel_width(), kPanelHeight);
  const auto px = [&](double v) { return canvas.panel_width() * x.at(v); };
  const auto py = [&](double v) { return kPanelHeight * y.at(v); };
  for (const Line& line : panel.lines) {
    for (const Mark& m : line.marks) {
      if (m.failed || m.y > 0) placer.keep_free(std::isnan(m.x) ? canvas.panel_width() : px(m.x), m.failed ? kPanelHeight - 4 : py(m.y));
    }
  }
  for (const PeerPoint& p : panel.peers) placer.keep_free(px(p.error), py(p.seconds));
  // A failure without an error stands in the corner.
  const auto across = [&](const Mark& m) { return std::clamp(std::isnan(m.x) ? x.high : m.x, x.low, x.high); };
  int tag = 1;
  const auto label = [&](double vx, double vy, const std::string& words, const std::string& colour) {
    const auto place = placer.place(px(vx), py(vy), words);
    if (!place) return;
    out << "set label " << tag++ << " " << quoted(words) << " at first " << vx << ", first " << vy << " center offset screen "
        << canvas.x(place->dx) << ", screen " << canvas.y(place->dy) << " font ',9' tc rgb '" << colour << "'\n";
  };
  for (const PeerPoint& p : panel.peers) label(p.error, p.seconds, p.name + " (others)", "#000000");
  if (panel.labels) {
    for (const Line& line : panel.lines) {
      for (const Mark& m : line.marks) {
        if (m.failed || (m.x > 0 && m.y > 0)) label(across(m), m.failed ? y.high : m.y, m.label, kColours[line.colour]);
      }
    }
  }

  // Slope triangles: the hypotenuse runs along the expected slope, below the line's middle.
  int arrow = 1;
  std::set<double> drawn;
  for (const Line& line : panel.lines) {
    if (line.expected_slope == 0 || line.marks.size() < 3 || !drawn.insert(line.expected_slope).second) continue;
    const Mark& middle = line.marks[line.marks.size() / 2];
    if (!(middle.x > 0 && middle.y > 0)) continue;
    const double x0 = middle.x * 0.42, y0 = middle.y * 0.42, run = std::pow(10, 0.35), x1 = x0 * run, y1 = y0 * std::pow(run, line.expected_slope);
    const auto stroke = [&](double ax, double ay, double bx, double by) {
      out << "set arrow " << arrow++ << " from first " << ax << ", first " << ay << " to first " << bx << ", first " << by
          << " nohead lw 1 lc rgb '#999999'\n";
    };
    stroke(x0, y0, x1, y1);
    stroke(x0, y0, x1, y0);
    stroke(x1, y0, x1, y1);
    out << "set label " << tag++ << " " << quoted(line.slope_label) << " at first " << x1 * 1.06 << ", first " << std::sqrt(y0 * y1)
        << " left font ',9' tc rgb '#777777'\n";
  }

  // Data blocks, then one plot.
  std::ostringstream plot;
  const char* comma = "plot ";
  for (std::size_t k = 0; k < panel.lines.size(); ++k) {
    const Line& line = panel.lines[k];
    std::ostringstream good, bad;
    good << std::setprecision(8);
    bad << std::setprecision(8);
    int n_good = 0, n_bad = 0;
    for (const Mark& m : line.marks) {
      if (m.failed) {
        bad << across(m) << " " << y.high << "\n";
        ++n_bad;
      } else if (!std::isnan(m.x) && !std::isnan(m.y)) {
        good << std::clamp(m.x, x.low, x.high) << " " << std::clamp(m.y, y.low, y.high) << " " << std::clamp(m.y_low, y.low, y.high) << " "
             << std::clamp(m.y_high, y.low, y.high) << "\n";
        ++n_good;
      }
    }
    if (n_good > 0) {
      out << "$p" << index << "_" << k << " << EOD\n" << good.str() << "EOD\n";
      plot << comma << "$p" << index << "_" << k << " using 1:2:3:4 with yerrorbars pt " << line.shape << " ps 0.1 lw 1 lc rgb '" << kColours[line.colour] << "'";
      plot << ", $p" << index << "_" << k << " using 1:2 with " << (line.joined ? "linespoints" : "points") << " pt " << line.shape
           << " ps 0.9 lw 1.6 lc rgb '" << kColours[line.colour] << "'";
      comma = ", ";
    }
    if (n_bad > 0) {
      out << "$f" << index << "_" << k << " << EOD\n" << bad.str() << "EOD\n";
      plot << comma << "$f" << index << "_" << k << " using 1:2 with points pt 2 ps 1.3 lw 2.2 lc rgb '" << kColours[line.colour] << "'";
      comma = ", ";
    }
  }
  if (!panel.peers.empty()) {
    out << "$peers << EOD\n";
    for (const PeerPoint& p : panel.peers) out << p.error << " " << p.seconds << "\n";
    out << "EOD\n";
    plot << comma << "$peers using 1:2 with points pt 3 ps 1.5 lw 1.8 lc rgb '#000000'";
    comma = ", ";
  }
  if (!panel.front.empty()) {
    out << "$front << EOD\n";
    for (const auto& [e, s] : panel.front) out << e << " " << s << "\n";
    out << "EOD\n";
    plot << comma << "$front using 1:2 with steps lw 1.2 lc rgb '#222222'";
    comma = ", ";
  }
  if (plot.str().empty()) plot << "plot NaN";
  out << plot.str() << "\n";
}

}  // namespace crumple::lab::chart
