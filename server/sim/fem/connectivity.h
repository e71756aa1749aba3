#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::sim::fem {

// Which tet corners meet at each node and at each edge: what the node pass of assembly gathers from, in mesh order.
struct Connectivity {
  std::vector<Tet> tets;                  // of which the rest was made
  std::vector<int> node_start;            // node_count + 1, into node_corners
  std::vector<int> node_corners;          // 4 tet + local node
  std::vector<std::array<int, 2>> edges;  // node ids, first < second; ascending
  std::vector<int> edge_start;            // edge_count + 1, into edge_corners
  std::vector<int> edge_corners;          // 16 tet + 4 local node of edge[0] + local node of edge[1]

  int node_count() const { return static_cast<int>(node_start.size()) - 1; }
  int edge_count() const { return static_cast<int>(edges.size()); }
};

// Ids must be in [0, node_count).
Connectivity make_connectivity(int node_count, const std::vector<Tet>& tets);

}  // namespace crumple::sim::fem
