#include "server/sim/example_based/geodesic_distance.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <limits>

namespace crumple::sim::example_based {

EdgeGraph edge_graph(std::span<const Vec3> X, std::span<const Tet> tets) {
  std::vector<std::pair<int, int>> edges;  // both directions
  edges.reserve(tets.size() * 12);
  for (const Tet& tet : tets)
    for (int a : tet)
      for (int b : tet)
        if (a != b) edges.emplace_back(a, b);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  EdgeGraph graph;
  graph.start.assign(X.size() + 1, 0);
  graph.neighbour.reserve(edges.size());
  graph.length.reserve(edges.size());
  for (const auto& [a, b] : edges) {
    ++graph.start[a + 1];
    graph.neighbour.push_back(b);
    graph.length.push_back((X[a] - X[b]).norm());
  }
  for (std::size_t i = 0; i < X.size(); ++i) graph.start[i + 1] += graph.start[i];
  return graph;
}

std::span<const Reached> GeodesicSearch::run(const EdgeGraph& graph, int source, double bound) {
  assert(source >= 0 && source < graph.vertex_count() && bound > 0);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  if (static_cast<int>(distance_.size()) != graph.vertex_count()) distance_.assign(graph.vertex_count(), kFar);
  reached_.clear();
  heap_.clear();

  const auto nearer = [&](int vertex, double d) {
    if (d >= bound || d >= distance_[vertex]) return;
    if (distance_[vertex] == kFar) reached_.push_back({vertex, 0});
    distance_[vertex] = d;
    heap_.emplace_back(d, vertex);
    std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
  };
  nearer(source, 0);
  while (!heap_.empty()) {
    const auto [d, vertex] = heap_.front();
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    heap_.pop_back();
    if (d > distance_[vertex]) continue;  // a shorter way was found after this one was pushed
    for (int k = graph.start[vertex]; k < graph.start[vertex + 1]; ++k) nearer(graph.neighbour[k], d + graph.length[k]);
  }

  std::sort(reached_.begin(), reached_.end(), [](const Reached& a, const Reached& b) { return a.vertex < b.vertex; });
  for (Reached& r : reached_) r.distance = std::exchange(distance_[r.vertex], kFar);
  return reached_;
}

}  // namespace crumple::sim::example_based
