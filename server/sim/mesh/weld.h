#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::sim {

// For each point the first of the list that is within `tolerance` of it [m], itself if there is none. Chains are not
// followed: one that is near a point which has itself gone to another may stay alone.
std::vector<int> weld(std::span<const Vec3> points, double tolerance);

}  // namespace crumple::sim
