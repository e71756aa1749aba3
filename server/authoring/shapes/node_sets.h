#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::authoring {

// Ids, ascending, of the nodes inside a box [m], its faces included.
std::vector<int> nodes_in_box(std::span<const Vec3> X, const Vec3& lower, const Vec3& upper);

enum class Side { min_x, max_x, min_y, max_y, min_z, max_z };

// Ids, ascending, of the nodes on one side of the nodes' own box, within a billionth of the box's diagonal.
std::vector<int> nodes_on_side(std::span<const Vec3> X, Side side);

// The same for several sides together, each node once; e.g. the four edges of a pane.
std::vector<int> nodes_on_sides(std::span<const Vec3> X, std::span<const Side> sides);

}  // namespace crumple::authoring
