#include "server/sim/mesh/node_stars.h"

#include <algorithm>
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

void NodeStars::undo_split(int node) {
  assert(begin_.back() == end_[node] && node < node_count() - 1);
  std::inplace_merge(tets_.begin() + begin_[node], tets_.begin() + end_[node], tets_.begin() + end_.back());
  end_[node] = end_.back();
  begin_.pop_back();
  end_.pop_back();
}

}  // namespace crumple::sim
