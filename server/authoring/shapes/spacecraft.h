#pragma once

#include "server/authoring/shapes/loft.h"

// Shapes of the benchmark scenes after Jones et al. 2016, figures 9 and 10, in parts as they are scored.
namespace crumple::authoring {

// A fighter towards +x, about 14 x 3 x 13 m: the fuselage, and a wing on the side of z that `side` (-1, 1) names, whose
// root lies at kWingRoot.
Loft fighter_fuselage();
Loft fighter_wing(int side);
inline const Vec3 kWingRoot(-1.6, 0, 1.1);  // on the side of +z [m]

// A ship of 124 m towards +x: hull, tower and two engines in one surface.
sim::SurfaceMesh large_ship();

// A crane of 24 m, upwards from y = 0: two halves of its mast, the tower's head, the jib towards +x and the one behind with its
// counterweight. Joined at the points in `kCraneJoints`, each part to the one before it, and the last two to the head.
std::vector<Loft> crane_parts();
inline const Vec3 kCraneJoints[] = {{0, 0, 0}, {0, 9, 0}, {0, 18, 0}, {0.9, 20, 0}, {-0.9, 20, 0}};  // [m]

}  // namespace crumple::authoring
