#pragma once

#include "server/lab/chart/study.h"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

// One panel of a figure on logarithmic axes, as statements of gnuplot.
namespace crumple::lab::chart {

// Of a figure's canvas [px].
inline constexpr double kPanel = 430, kLonePanel = 660, kPanelHeight = 360, kLeft = 84, kGap = 84, kRight = 26, kTop = 44, kBottom = 58;
inline constexpr double kLegendRow = 17, kFooter = 36;
inline constexpr const char* kColours[] = {"#0b6e99", "#d1495b", "#3a8f4d", "#8a5fbf", "#e08e1b", "#5b5b5b", "#17a2a2", "#a0522d", "#c04fa0", "#7a8f00"};
inline constexpr int kColourCount = 10;

std::string quoted(const std::string& text);  // as gnuplot reads it

struct Mark {
  double x, y, y_low, y_high;
  std::string label;
  bool failed;
};

struct Line {
  std::string name;
  std::vector<Mark> marks;
  int colour, shape;
  bool joined = true;
  double expected_slope = 0;  // of log y against log x; 0: no triangle
  std::string slope_label;
};

struct Panel {
  std::string x_axis, y_axis;
  std::vector<Line> lines;
  double floor = 0;       // shaded from the left
  bool real_time = false;
  std::vector<PeerPoint> peers;
  std::vector<std::pair<double, double>> front;
  bool labels = true;
};

class Canvas {
 public:
  Canvas(int panels, int legend_rows) : panel_width_(panels == 1 ? kLonePanel : kPanel) {
    width_ = kLeft + panels * panel_width_ + (panels - 1) * kGap + kRight;
    height_ = kTop + kPanelHeight + kBottom + legend_rows * kLegendRow + kFooter;
  }
  double width() const { return width_; }
  double height() const { return height_; }
  double x(double px) const { return px / width_; }
  double y(double px) const { return px / height_; }
  double panel_width() const { return panel_width_; }
  double panel_left(int k) const { return kLeft + k * (panel_width_ + kGap); }
  double panel_bottom() const { return height_ - kTop - kPanelHeight; }

 private:
  double panel_width_, width_, height_;
};

// Appends panel `index` of the canvas: axes, lines with bars, what failed, and labels that do not overlap.
void draw_panel(const Canvas& canvas, int index, const Panel& panel, std::ostringstream& out);

}  // namespace crumple::lab::chart
