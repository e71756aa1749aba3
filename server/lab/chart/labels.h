#pragma once

#include <optional>
#include <string>
#include <vector>

namespace crumple::lab::chart {

// Finds places for labels beside their points in a panel, so that none covers another or a marker. All in pixels, y up.
class LabelPlacer {
 public:
  LabelPlacer(double width, double height) : width_(width), height_(height) {}

  void keep_free(double x, double y);  // a marker

  struct Place {
    double dx, dy;  // of the label's middle from the point
  };
  // The first of eight places around (x, y) that is free and inside the panel; it is then taken. Nothing: leave it out.
  std::optional<Place> place(double x, double y, const std::string& text);

 private:
  struct Rectangle {
    double left, right, bottom, top;
  };
  double width_, height_;
  std::vector<Rectangle> taken_;
};

}  // namespace crumple::lab::chart
