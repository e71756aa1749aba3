#include "server/lab/chart/labels.h"

#include <algorithm>

namespace crumple::lab::chart {
namespace {

constexpr double kMarker = 4, kCharacter = 6.8, kLine = 11;  // [px], of a font of 9 points

}  // namespace

void LabelPlacer::keep_free(double x, double y) { taken_.push_back({x - kMarker, x + kMarker, y - kMarker, y + kMarker}); }

std::optional<LabelPlacer::Place> LabelPlacer::place(double x, double y, const std::string& text) {
  const double half = 0.5 * kCharacter * static_cast<double>(text.size()) + 1, high = 0.5 * kLine;
  const double beside = half + kMarker + 2, above = high + kMarker + 3;
  const Place places[] = {{beside, 0}, {-beside, 0}, {0, above}, {0, -above}, {beside, above}, {-beside, -above}, {beside, -above}, {-beside, above}};
  for (const Place& p : places) {
    const Rectangle r{x + p.dx - half, x + p.dx + half, y + p.dy - high, y + p.dy + high};
    if (r.left < 0 || r.right > width_ || r.bottom < 0 || r.top > height_) continue;
    const bool free = std::none_of(taken_.begin(), taken_.end(), [&](const Rectangle& t) {
      return r.left < t.right && t.left < r.right && r.bottom < t.top && t.bottom < r.top;
    });
    if (!free) continue;
    taken_.push_back(r);
    return p;
  }
  return std::nullopt;
}

}  // namespace crumple::lab::chart
