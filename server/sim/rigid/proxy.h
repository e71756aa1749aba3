#pragma once

#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"
#include "server/sim/scene.h"

#include <optional>
#include <vector>

namespace crumple::sim {

// Tets that stand for a rigid body against soft ones (whose contact is between tets), in body axes: each shape's
// surface joined to a point inside it. Boxes give 12 tets, spheres 80, cylinders 64 (both of the right volume, so
// slightly larger than the shape at their corners), hulls one a hull triangle; shapes of a compound are simply put
// together, where they overlap so do the tets. Planes give none: contact takes them as half-spaces, so a body of
// planes only has an empty mesh. nullopt: a shape of triangles, or a hull of no volume.
std::optional<TetMesh> proxy_tets(const std::vector<PlacedShape>& shapes);

// Outward triangles to draw a rigid body with, in body axes. A plane is a square of 10 by 10 squares about the point
// of it nearest to the shape's origin; plane_reach: from there to the middle of its sides [m].
SurfaceMesh draw_mesh(const std::vector<PlacedShape>& shapes, double plane_reach = 10);

}  // namespace crumple::sim
