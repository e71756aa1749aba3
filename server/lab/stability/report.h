#pragma once

#include "common/error.h"
#include "server/lab/stability/survey.h"

#include <filesystem>

namespace crumple::lab::stability {

// rows.csv: number, name, method, standing, verdict, value, slowest step over the median one (0: not timed), text.
// maps.csv: map, method, x, y, state, note.
void write_tables(const Survey& survey, const std::filesystem::path& dir);

// One figure a map, a panel a method, drawn by gnuplot: DIR/<map>.png, and the SVG as text, by map.
// Error: gnuplot is missing or fails.
Result<std::map<std::string, std::string>> draw_maps(const Survey& survey, const std::filesystem::path& dir);

// DIR/index.html, self-contained.
void write_page(const Survey& survey, const std::map<std::string, std::string>& figures,
                const std::filesystem::path& dir);

}  // namespace crumple::lab::stability
