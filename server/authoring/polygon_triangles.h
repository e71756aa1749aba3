#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::authoring {

// Loops in a plane, grouped: one that runs round something, then the holes that it encloses.
using LoopGroup = std::vector<std::vector<int>>;
std::vector<LoopGroup> grouped(std::span<const Vec3> points, const std::vector<std::vector<int>>& loops);

// Triangles of a flat face by cutting off ears, with the face's own points alone. points: of the solid; group: ids of
// points, the outer loop counter-clockwise seen along -normal, holes clockwise. Holes are joined to the loop around them by
// the shortest bridge that crosses nothing. Loops that touch or are folded by rounding give thin triangles, never fewer
// points.
std::vector<Triangle> triangles_of(std::span<const Vec3> points, const LoopGroup& group);

}  // namespace crumple::authoring
