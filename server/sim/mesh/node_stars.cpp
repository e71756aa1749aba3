#include "server/sim/mesh/node_stars.h"

#include <cassert>

namespace crumple::sim {

NodeStars::NodeStars(std::span<const Tet> tets, int node_count) : begin_(node_count, 0), tets_(4 * tets.size()) {
  for (const Tet& tet : tets)
    for (const int node : tet) {
      assert(node >= 0 && node < node_count);
      ++begin_[node];
    }
  int sum = 0;
  for (int& b : begin_) {
    const int count = b;
    b = sum;
    sum += count;
  }
  end_ = begin_;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t)
    for (const int node : tets[t]) tets_[end_[node]++] = t;
}

}  // namespace crumple::sim
