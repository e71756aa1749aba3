#pragma once

#include "common/types.h"
#include "server/sim/mesh/surface_mesh.h"

// Closed triangle surfaces of simple solids about the origin, outward.
namespace crumple::sim {

SurfaceMesh box_surface(const Vec3& half_extents);                           // 8 vertices, 12 triangles
SurfaceMesh icosphere(double radius, int levels);                            // 20 * 4^levels triangles
SurfaceMesh cylinder_surface(double radius, double half_length, int sides);  // axis y, 4 * sides triangles

// Volume enclosed by a closed outward mesh [m^3].
double enclosed_volume(const SurfaceMesh& mesh);

}  // namespace crumple::sim
