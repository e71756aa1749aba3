#pragma once

#include "common/types.h"

#include <span>
#include <utility>
#include <vector>

// Approximate geodesic distance: the shortest path over the mesh's edges (Jones et al. 2016, section 3.2.2, which uses
// "a few passes of Dijkstra's algorithm"). Path lengths are those of the rest shape: distance says which material is
// near, and that does not change when the body folds. It also makes every distance a constant that can be kept.
namespace crumple::sim::example_based {

// Undirected edges of a tet mesh, neighbours of vertex i at [start[i], start[i + 1]), ascending.
struct EdgeGraph {
  std::vector<int> start;      // vertices + 1
  std::vector<int> neighbour;  // vertex ids
  std::vector<double> length;  // [m]

  int vertex_count() const { return static_cast<int>(start.size()) - 1; }
};

EdgeGraph edge_graph(std::span<const Vec3> X, std::span<const Tet> tets);

struct Reached {
  int vertex;
  double distance;  // [m]
};

// Dijkstra's algorithm from one vertex, bounded. Owns the scratch; after the first search of a graph it allocates only
// where more vertices are reached than ever before.
class GeodesicSearch {
 public:
  // The vertices nearer to `source` than `bound` [m] (infinity: all that are connected), ascending by vertex. The
  // result is valid until the next search.
  std::span<const Reached> run(const EdgeGraph& graph, int source, double bound);

 private:
  std::vector<double> distance_;  // infinity for every vertex between searches
  std::vector<std::pair<double, int>> heap_;
  std::vector<Reached> reached_;
};

}  // namespace crumple::sim::example_based
