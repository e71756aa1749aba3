#pragma once

#include "server/lab/chart/study.h"

#include <filesystem>

namespace crumple::lab::chart {

// An error that says how to get it, if gnuplot does not run here.
Result<void> find_gnuplot();

// Curves of a study that a figure tells apart: of FigureKind::pareto, where colours are for something else, by their points alone.
inline constexpr int kPointShapes = 12, kMostCurves = 60;

struct Footer {
  // Stand under the panels of every figure: machine and compiler; commit, runs and scene.
  std::string made_on, made_of;
};

// The gnuplot program of a study's figure, without terminal and output: data inline, ranges, panels, legend, labels
// placed so that they do not overlap. width, height: of the canvas [px].
struct Figure {
  std::string program;
  int width = 0, height = 0;
};
Figure figure(const Study& study, const std::vector<Point>& points, const Footer& footer);

// Draws it as `name`.svg and `name`.png in `folder`. Error: gnuplot fails or a file cannot be written.
Result<void> draw(const Figure& figure, const std::filesystem::path& folder, const std::string& name);

}  // namespace crumple::lab::chart
