#pragma once

#include "common/error.h"
#include "server/sim/mesh/surface_mesh.h"

#include <span>
#include <string>

namespace crumple::sim {

// Convex hull of points, as closed outward triangles over a subset of the points themselves. Points nearer to the hull
// of the others than about 1e-4 of its size may be left out (the hull is found on a grid of integers).
// Error, prefixed by `field`: non-finite points, or points that span no volume (below 1e-9 of their box's cubed
// diagonal).
Result<SurfaceMesh> convex_hull(std::span<const Vec3> points, const std::string& field);

}  // namespace crumple::sim
