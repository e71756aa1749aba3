#pragma once

#include "server/sim/mesh/surface_mesh.h"

namespace crumple::authoring {

// A bulging barrel along y, centred on the origin, closed and outward. Its side follows
//   r(y) = radius (1 - taper (2 y / height)^2) + hoops,    each hoop a bump of `hoop_depth`,
// on `rings` circles from the lower to the upper rim. Lids: flat, or sunk by `lid_depth` behind the rim.
struct BarrelShape {
  double height = 0.9;        // [m]
  double radius = 0.318;      // at half height, hoops not counted [m]
  double taper = 0.06;        // part of the radius that is lost towards the rims [-]
  int hoops = 2;              // evenly spaced between the rims, which are hoops as well
  double hoop_depth = 0.012;  // [m]; 0: a plain profile, rims included
  double lid_depth = 0.02;    // [m]; 0: a lid is one fan
  int rings = 61;
  int segments = 48;
};

// The barrel of 288 triangles of the many-barrels benchmark: radius 0.3, taper 0.25, 12 x 12, plain.
BarrelShape plain_barrel();

// Triangles: 2 segments (rings + lid circles), lid circles: none for flat lids, 2 x 5 otherwise.
sim::SurfaceMesh barrel_surface(const BarrelShape& shape = {});

}  // namespace crumple::authoring
