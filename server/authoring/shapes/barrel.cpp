#include "server/authoring/shapes/barrel.h"

#include "server/authoring/shapes/surfaces.h"

#include <cassert>
#include <cmath>

namespace crumple::authoring {
namespace {

double side_radius(const BarrelShape& s, double y) {
  const double u = 2 * y / s.height;
  double r = s.radius * (1 - s.taper * u * u);
  for (int k = 0; k <= s.hoops + 1; ++k) {
    const double at = -1 + 2.0 * k / (s.hoops + 1);
    const double width = 0.02 / s.height * 2;  // hoops are about 4 cm wide
    r += s.hoop_depth * std::exp(-std::pow((u - at) / width, 2));
  }
  return r;
}

}  // namespace

BarrelShape plain_barrel() {
  return {.radius = 0.3, .taper = 0.25, .hoops = 0, .hoop_depth = 0, .lid_depth = 0, .rings = 12, .segments = 12};
}

sim::SurfaceMesh barrel_surface(const BarrelShape& s) {
  assert(s.height > 0 && s.radius > 0 && s.taper >= 0 && s.taper < 1 && s.rings >= 2 && s.segments >= 3);
  std::vector<Eigen::Vector2d> side;
  for (int k = 0; k < s.rings; ++k) {
    const double y = s.height * (static_cast<double>(k) / (s.rings - 1) - 0.5);
    side.push_back({side_radius(s, y), y});
  }
  // From the rim inwards: over the rim, down to the sunk lid, and circles on the lid, so that it can dent.
  std::vector<Eigen::Vector2d> lid;
  if (s.lid_depth > 0) {
    const double r = side.back().x(), y = s.height / 2;
    lid = {{0.95 * r, y}, {0.93 * r, y - s.lid_depth}};
    for (const double f : {0.7, 0.45, 0.2}) lid.push_back({f * r, y - s.lid_depth});
  }
  const double pole = s.height / 2 - s.lid_depth;
  std::vector<Eigen::Vector2d> profile{{0, -pole}};
  for (auto it = lid.rbegin(); it != lid.rend(); ++it) profile.push_back({it->x(), -it->y()});
  profile.insert(profile.end(), side.begin(), side.end());
  profile.insert(profile.end(), lid.begin(), lid.end());
  profile.push_back({0, pole});
  return lathe(profile, s.segments);
}

}  // namespace crumple::authoring
