#pragma once

#include "common/types.h"

#include <cstdint>
#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// A regular lattice laid over a body at rest: the points of a coarse level.
struct CoarseLattice {
  Vec3 origin = Vec3::Zero();   // [m]
  Vec3 spacing = Vec3::Ones();  // [m]
};

// The lattice for the first coarse level of a mesh. On a mesh whose coordinates stand on a lattice of their own it has
// every second plane of it, or every third where cells have points inside; on any other mesh it is twice as wide as the
// mean tet's cell. X: rest positions; mean_tet_volume [m^3].
CoarseLattice coarse_lattice(std::span<const Vec3> X, double mean_tet_volume);

// Which points of a level touch, row-compressed, each pair both ways, no point with itself.
struct LevelGraph {
  std::span<const int> row_start;  // points + 1
  std::span<const int> columns;
};

// How a level follows the next coarser one: point i moves by sum_k weight[k] u_coarse[k], k in [row_start[i],
// row_start[i + 1]). The weights of a point add to one, and reproduce functions that are linear over the lattice.
struct LevelTransfer {
  std::vector<int> row_start, coarse;      // by fine point
  std::vector<float> weight;
  std::vector<int> column_start, fine;     // the same by coarse point
  std::vector<float> column_weight;

  bool operator==(const LevelTransfer&) const = default;
  int fine_count() const { return static_cast<int>(row_start.size()) - 1; }
  int coarse_count() const { return static_cast<int>(column_start.size()) - 1; }
};

// Barycentric weights in the lattice's Kuhn tets (diagonal 000 -> 111). A lattice point becomes one coarse point for each
// connected component of the points that it moves: what a crack has parted, even by no width at all, is not moved
// together. A piece of a few nodes (finest: the points are nodes) becomes one coarse point; of coarser levels, stays.
// held: points that never move; they take no weights, but connect. coarse_X: positions of the coarse points.
LevelTransfer make_transfer(std::span<const Vec3> X, const LevelGraph& graph, std::span<const char> held,
                            const CoarseLattice& lattice, bool finest, std::vector<Vec3>& coarse_X);

}  // namespace crumple::sim::linear_solver
