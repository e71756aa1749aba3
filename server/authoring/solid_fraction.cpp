#include "server/authoring/solid_fraction.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using Barycentric = Eigen::Vector4d;

// The unit cube is cut into six congruent tets 0 <= s <= t <= u <= 1 by sorting the coordinates; the gaps between the
// sorted coordinates are the barycentric coordinates.
Barycentric fold_cube_into_tet(Vec3 p) {
  std::sort(p.begin(), p.end());
  return {p[0], p[1] - p[0], p[2] - p[1], 1 - p[2]};
}

const std::array<Barycentric, kFillSamples>& sample_points() {
  static const auto points = [] {
    // Powers of 1/g, g^4 = g + 1: the generalised golden ratio in three dimensions.
    constexpr double g = 1.22074408460575947536;
    const Vec3 step(1 / g, 1 / (g * g), 1 / (g * g * g));
    std::array<Barycentric, kFillSamples> out;
    for (int k = 0; k < kFillSamples; ++k) {
      const Vec3 p = Vec3::Constant(0.5) + (k + 1) * step;
      out[k] = fold_cube_into_tet(p - p.array().floor().matrix());
    }
    return out;
  }();
  return points;
}

}  // namespace

double solid_fraction(const WindingNumber& solid, const std::array<Vec3, 4>& corners) {
  int inside = 0;
  for (const Barycentric& b : sample_points())
    inside += solid.inside(b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2] + b[3] * corners[3]);
  return static_cast<double>(inside) / kFillSamples;
}

}  // namespace crumple::authoring
