#include "server/authoring/shapes/spacecraft.h"

#include "server/authoring/shapes/surfaces.h"

namespace crumple::authoring {

Loft fighter_fuselage() {
  return {.axis = 0,
          .stations = {{{-6.5, 0.1, 0}, 1.4, 1.0}, {{-5, 0.1, 0}, 2.4, 1.9}, {{-1.5, 0.2, 0}, 2.6, 2.4}, {{1.5, 0.2, 0}, 2.0, 2.0},
                       {{4.5, -0.1, 0}, 1.2, 1.1}, {{7, -0.3, 0}, 0.4, 0.4}},
          .power = 2.5};
}

Loft fighter_wing(int side) {
  const LoftStation root{{-1.6, 0, 1.0 * side}, 6, 0.8}, middle{{-2.4, -0.2, 3.4 * side}, 4.2, 0.6}, tip{{-3.4, -0.5, 6.5 * side}, 2.2, 0.45};
  Loft wing{.axis = 2, .stations = {root, middle, tip}, .power = 2};
  if (side < 0) std::swap(wing.stations.front(), wing.stations.back());
  return wing;
}

sim::SurfaceMesh large_ship() {
  sim::SurfaceMesh ship = loft_surface({.axis = 0,
                                        .stations = {{{-62, 0, 0}, 14, 10}, {{-50, 0, 0}, 26, 16}, {{-20, 0, 0}, 30, 18},
                                                     {{10, -1, 0}, 24, 15}, {{40, -2, 0}, 14, 9}, {{62, -3, 0}, 4, 3}},
                                        .sides = 24,
                                        .power = 3});
  append(ship, loft_surface({.axis = 1, .stations = {{{-30, 7, 0}, 24, 12}, {{-33, 14, 0}, 14, 9}, {{-34, 19, 0}, 8, 7}}, .power = 4}));
  for (const double side : {-1.0, 1.0})
    append(ship, loft_surface({.axis = 0, .stations = {{{-60, 0, 17 * side}, 6, 6}, {{-35, 0, 17 * side}, 8, 8}, {{-24, 0, 15 * side}, 4, 4}}}));
  return ship;
}

std::vector<Loft> crane_parts() {
  const auto mast = [](double from, double to) {
    return Loft{.axis = 1, .stations = {{{0, from, 0}, 1.8, 1.8}, {{0, (from + to) / 2, 0}, 1.8, 1.8}, {{0, to, 0}, 1.8, 1.8}}, .sides = 12, .power = 6};
  };
  const Loft head{.axis = 1, .stations = {{{0, 18, 0}, 2.4, 2.4}, {{0, 21, 0}, 2.0, 2.0}, {{0, 24, 0}, 0.8, 0.8}}, .sides = 12, .power = 4};
  const Loft jib{.axis = 0, .stations = {{{0.9, 20, 0}, 1.5, 1.7}, {{9, 20.1, 0}, 1.3, 1.4}, {{17, 20.2, 0}, 0.9, 0.9}}, .sides = 12, .power = 6};
  const Loft counter{.axis = 0, .stations = {{{-8, 19.6, 0}, 2.6, 2.6}, {{-6, 19.6, 0}, 2.6, 2.6}, {{-5, 20, 0}, 1.3, 1.4}, {{-0.9, 20, 0}, 1.5, 1.7}}, .sides = 12, .power = 6};
  return {mast(0, 9), mast(9, 18), head, jib, counter};
}

}  // namespace crumple::authoring
