#pragma once

#include "common/types.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace crumple::sim::fem {

struct RestBody;

// The tets around an edge.
struct EdgeStar {
  std::int64_t shortness = 0;  // of two edges of a lattice the same, whatever was rounded
  std::array<int, 2> edge;     // ascending
  std::vector<int> tets;       // ascending
};

// Of all edges, the longest first, of equal ones in the order of their nodes; of those tets that are asked for.
std::vector<EdgeStar> edge_stars_by_length(const std::vector<Tet>& tets, const RestBody& rest, const std::function<bool(int t)>& is_eligible);

// The two nodes of a tet that are not on the edge, in the order that makes (edge[0], edge[1], first, second) positive.
std::array<int, 2> around(const Tet& tet, const std::array<int, 2>& edge);

// Rest positions of a tet's nodes from its first.
Mat34 rest_nodes(const RestBody& rest, int t);

}  // namespace crumple::sim::fem
