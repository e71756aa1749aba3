#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::io {

// Cuts a polygon into n - 2 triangles that keep its orientation, by clipping ears in the plane normal to its vector
// area (Newell's sum): right for every simple, about flat polygon, convex or not. Where no ear is left (a polygon that
// crosses itself) the rest is cut into a fan. X: the mesh's vertices, ids: the corners in order, at least three.
void cut_polygon(std::span<const Vec3> X, std::vector<int> ids, std::vector<Triangle>& out);

}  // namespace crumple::io
