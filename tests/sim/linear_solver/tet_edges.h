#pragma once

#include "common/types.h"

#include <algorithm>
#include <vector>

namespace crumple::sim::linear_solver {

// The edges of tets as BlockSparseMatrix::from_edges takes them.
inline std::vector<std::array<int, 2>> edges_of(const std::vector<Tet>& tets) {
  std::vector<std::array<int, 2>> edges;
  for (const Tet& tet : tets)
    for (const int i : tet)
      for (const int j : tet)
        if (i < j) edges.push_back({i, j});
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace crumple::sim::linear_solver
