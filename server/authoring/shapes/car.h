#pragma once

#include "server/sim/mesh/surface_mesh.h"

namespace crumple::authoring {

// A saloon car of closed, outward parts: the body with bonnet, cabin and boot (windows sunk, door gaps, wheel arches),
// two bumpers, four lamps and four wheels. It drives towards +x, y is up, it stands on y = 0 with its middle over the
// origin. The parts overlap: the whole is closed but intersects itself.
struct CarShape {
  double length = 4.2;  // over the bumpers [m]
  double width = 1.7;   // [m]
  double height = 1.4;  // [m]
};

struct CarSurface {
  sim::SurfaceMesh body;                   // without the wheels
  std::array<sim::SurfaceMesh, 4> wheels;  // front left (+z is right), front right, rear left, rear right
  std::array<Vec3, 4> wheel_centres;       // [m]
  double wheel_radius;                     // in height [m]
  double wheel_width;                      // [m]
  double belt_height;                      // lower edge of the side windows [m]

  sim::SurfaceMesh whole() const;
};

CarSurface car_surface(const CarShape& shape = {});

}  // namespace crumple::authoring
