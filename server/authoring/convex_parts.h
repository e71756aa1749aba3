#pragma once

#include "common/types.h"

#include <vector>

// Collision parts: vertex ids whose hull moves with the skin (ExampleSet::convex_parts). All of a region's surface
// nodes are listed; example_based/hull_points.h picks those worth carrying. A part that has no volume (fewer than four
// nodes, or flat within 1e-3 of its extent) comes out empty.
namespace crumple::authoring {

// The nodes of `surface` inside a box.
std::vector<int> hull_part_in_box(const std::vector<Vec3>& X, const std::vector<int>& surface, const Vec3& lower,
                                  const Vec3& upper);

// `slabs` parts along the longest axis of the points' box, each `overlap` [m] longer at both ends, so that neighbours'
// hulls meet; parts without volume are left out.
std::vector<std::vector<int>> hull_parts_along_longest_axis(const std::vector<Vec3>& X, const std::vector<int>& surface,
                                                            int slabs, double overlap);

}  // namespace crumple::authoring
