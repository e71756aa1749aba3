#include "server/sim/fem/connectivity.h"

#include <algorithm>

namespace crumple::sim::fem {

namespace {

void collect_node_corners(int node_count, Connectivity& c) {
  c.node_start.assign(node_count + 1, 0);
  for (const Tet& tet : c.tets)
    for (int i : tet) ++c.node_start[i + 1];
  for (int i = 0; i < node_count; ++i) c.node_start[i + 1] += c.node_start[i];
  std::vector<int> next(c.node_start.begin(), c.node_start.end() - 1);
  c.node_corners.resize(4 * c.tets.size());
  for (int t = 0; t < static_cast<int>(c.tets.size()); ++t)
    for (int a = 0; a < 4; ++a) c.node_corners[next[c.tets[t][a]]++] = 4 * t + a;
}

struct EdgeCorner {
  std::array<int, 2> edge;
  int corner;
  auto operator<=>(const EdgeCorner&) const = default;
};

void collect_edge_corners(Connectivity& c) {
  // Bucketed by the lower node (its corners come in mesh order), then sorted within the few of one node.
  std::vector<EdgeCorner> at_node;
  for (int i = 0; i < c.node_count(); ++i) {
    at_node.clear();
    for (int k = c.node_start[i]; k < c.node_start[i + 1]; ++k) {
      const int t = c.node_corners[k] / 4, a = c.node_corners[k] % 4;
      for (int b = 0; b < 4; ++b)
        if (c.tets[t][b] > i) at_node.push_back({{i, c.tets[t][b]}, 16 * t + 4 * a + b});
    }
    std::sort(at_node.begin(), at_node.end());
    for (const EdgeCorner& e : at_node) {
      if (c.edges.empty() || c.edges.back() != e.edge) {
        c.edge_start.push_back(static_cast<int>(c.edge_corners.size()));
        c.edges.push_back(e.edge);
      }
      c.edge_corners.push_back(e.corner);
    }
  }
  c.edge_start.push_back(static_cast<int>(c.edge_corners.size()));
}

}  // namespace

Connectivity make_connectivity(int node_count, const std::vector<Tet>& tets) {
  Connectivity c;
  c.tets = tets;
  collect_node_corners(node_count, c);
  collect_edge_corners(c);
  return c;
}

}  // namespace crumple::sim::fem
