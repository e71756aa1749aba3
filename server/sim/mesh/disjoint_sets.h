#pragma once

#include <algorithm>
#include <vector>

// Disjoint sets as a forest: parent[i] of each member, a root's is itself. Start from parent[i] = i.
namespace crumple::sim {

inline int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// A set's root is its lowest member, in whatever order sets are joined.
inline void unite(std::vector<int>& parent, int a, int b) {
  const int p = find_root(parent, a), q = find_root(parent, b);
  parent[std::max(p, q)] = std::min(p, q);
}

}  // namespace crumple::sim
