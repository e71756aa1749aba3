#pragma once

#include "common/types.h"

#include <vector>

// Flat convex polygons in space, by their corners in order.
namespace crumple::authoring {

using Polygon = std::vector<Vec3>;

// The part where normal . p <= offset; fewer than three corners: nothing.
Polygon clip(const Polygon& polygon, const Vec3& normal, double offset);

// Area times the unit normal, on whose side corners run counter-clockwise [m^2].
Vec3 area_vector(const Polygon& polygon);

// Centroid times area [m^3].
Vec3 area_moment(const Polygon& polygon);

}  // namespace crumple::authoring
