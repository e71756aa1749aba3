#include "server/authoring/painted_regions.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

constexpr double kOctaves = 4;

}  // namespace

double region_scale(double channel) { return std::exp2(kOctaves * (2 * channel - 1)); }

double region_channel(double scale) {
  if (!(scale > 0)) return 0;
  return std::clamp(0.5 * (std::log2(scale) / kOctaves + 1), 0.0, 1.0);
}

}  // namespace crumple::authoring
