#pragma once

#include "server/lab/chart/study.h"

#include <string>
#include <vector>

namespace crumple::lab::chart {

struct Drawn {
  const Study* study;
  std::vector<Point> points;
  std::string svg;  // empty: the study could not run
};

// One self-contained HTML page: conclusions, figures, tables. head: a sentence on how it was made.
std::string page(const std::vector<Drawn>& drawn, const std::vector<NotBuilt>& not_built, const std::string& head);

// Text as it may stand in HTML.
std::string escaped(const std::string& text);

}  // namespace crumple::lab::chart
