#pragma once

#include "common/types.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::fem {

// The nodes of each of a body's elements, row-compressed.
struct ElementNodes {
  std::vector<int> start;  // element count + 1
  std::vector<int> nodes;  // one a corner, at most kMaxCorners an element
};
inline constexpr int kMaxCorners = 32;

// Which element corners meet at each node and at each edge: what the node pass of assembly gathers from, in mesh order. An
// edge is any two nodes of an element.
struct Connectivity {
  std::vector<int> node_start;            // node_count + 1, into node_corners
  std::vector<int> node_corners;          // corners
  std::vector<std::array<int, 2>> edges;  // node ids, first < second; ascending
  std::vector<int> edge_start;            // edge_count + 1, into edge_corners
  std::vector<std::uint32_t> edge_corners;  // of pairs: see below

  // A pair of corners of one element in one number.
  static std::uint32_t pair(int a, int b) { return 2 * kMaxCorners * a + kMaxCorners + (b - a); }
  static int first(std::uint32_t pair) { return static_cast<int>(pair / (2 * kMaxCorners)); }
  static int second(std::uint32_t pair) { return first(pair) + static_cast<int>(pair % (2 * kMaxCorners)) - kMaxCorners; }

  int node_count() const { return static_cast<int>(node_start.size()) - 1; }
  int edge_count() const { return static_cast<int>(edges.size()); }
};

// Ids must be in [0, node_count).
Connectivity make_connectivity(int node_count, const ElementNodes& elements);

}  // namespace crumple::sim::fem
