#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::lab::stability {

// Pairs of triangles that cut each other; triangles that share a corner do not count. Every pair is looked at: for some
// hundred triangles.
int self_intersections(std::span<const Triangle> triangles, const std::vector<Vec3>& x);

}  // namespace crumple::lab::stability
