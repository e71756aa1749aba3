#pragma once

#include "server/sim/example_based/example_state.h"

#include <span>
#include <vector>

// Collision points of the convex parts of an example-based body: hulls whose vertices move with the skin (in place of
// the paper's triangle mesh; DESIGN: it costs a fifteenth).
namespace crumple::sim::example_based {

// The vertices of `part` that are worth carrying: enough that their hull reaches within 0.1 % of the part's size of the
// whole part's in 320 directions in the rest pose, and within 0.5 % in 200 directions in every other example. Shapes in
// between are blends of these; a test holds their hulls to 2 %. The 26 directions to the corners, edges and faces of a
// box come first, so that boxes keep exactly their corners. Ascending; at least 4.
std::vector<int> hull_candidates(const ExampleRest& rest, std::span<const int> part);

// Skinned positions of part p's candidates [m, asset's axes], in the order of rest.hull_vertices[p]. Reuses `points`.
void hull_points(const ExampleRest& rest, const ExampleState& state, int p, std::vector<Vec3>& points);

}  // namespace crumple::sim::example_based
