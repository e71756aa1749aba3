#include "server/sim/fem/connectivity.h"

#include <algorithm>

namespace crumple::sim::fem {

namespace {

void collect_node_corners(int node_count, const ElementNodes& elements, Connectivity& c) {
  c.node_start.assign(node_count + 1, 0);
  for (const int i : elements.nodes) ++c.node_start[i + 1];
  for (int i = 0; i < node_count; ++i) c.node_start[i + 1] += c.node_start[i];
  std::vector<int> next(c.node_start.begin(), c.node_start.end() - 1);
  c.node_corners.resize(elements.nodes.size());
  for (int corner = 0; corner < static_cast<int>(elements.nodes.size()); ++corner)
    c.node_corners[next[elements.nodes[corner]]++] = corner;
}

void collect_edge_corners(const ElementNodes& elements, Connectivity& c) {
  std::vector<int> element_of(elements.nodes.size());
  std::size_t pairs = 0;
  for (std::size_t e = 0; e + 1 < elements.start.size(); ++e) {
    std::fill(element_of.begin() + elements.start[e], element_of.begin() + elements.start[e + 1], static_cast<int>(e));
    const std::size_t n = elements.start[e + 1] - elements.start[e];
    pairs += n * (n - 1) / 2;
  }
  c.edge_corners.reserve(pairs);
  // Bucketed by the lower node (its corners come in mesh order), then sorted within the few of one node.
  std::vector<std::uint64_t> at_node;  // upper node, pair of corners
  for (int i = 0; i < c.node_count(); ++i) {
    at_node.clear();
    for (int k = c.node_start[i]; k < c.node_start[i + 1]; ++k) {
      const int a = c.node_corners[k], e = element_of[a];
      for (int b = elements.start[e]; b < elements.start[e + 1]; ++b)
        if (elements.nodes[b] > i) at_node.push_back(static_cast<std::uint64_t>(elements.nodes[b]) << 32 | Connectivity::pair(a, b));
    }
    std::sort(at_node.begin(), at_node.end());
    int last = -1;
    for (const std::uint64_t corner : at_node) {
      const int upper = static_cast<int>(corner >> 32);
      if (upper != last) {
        c.edge_start.push_back(static_cast<int>(c.edge_corners.size()));
        c.edges.push_back({i, upper});
        last = upper;
      }
      c.edge_corners.push_back(static_cast<std::uint32_t>(corner));
    }
  }
  c.edge_start.push_back(static_cast<int>(c.edge_corners.size()));
  c.edge_start.shrink_to_fit();  // kept for long
  c.edges.shrink_to_fit();
}

}  // namespace

Connectivity make_connectivity(int node_count, const ElementNodes& elements) {
  Connectivity c;
  collect_node_corners(node_count, elements, c);
  collect_edge_corners(elements, c);
  return c;
}

}  // namespace crumple::sim::fem
