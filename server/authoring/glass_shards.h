#pragma once

#include "common/types.h"

#include <cstdint>
#include <vector>

namespace crumple::authoring {

// A convex piece of a plane.
struct Shard {
  struct Edge {
    Eigen::Vector2d normal;       // unit length, outwards
    double offset;                // the shard is where normal . p <= offset for all edges [m]
    std::vector<int> neighbours;  // shards on the other side; none at the rim
  };
  std::vector<Eigen::Vector2d> corners;  // counter-clockwise; edge k goes from corner k to the next [m]
  std::vector<Edge> edges;
};

// A rectangle cut across and across by straight lines, each right through one piece and near its middle, until no piece is
// larger than size^2. So cracks end at cracks, and corners are pointed, as in glass. The same for the same seed.
std::vector<Shard> glass_shards(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double size, std::uint64_t seed);

}  // namespace crumple::authoring
