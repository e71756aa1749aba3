#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace crumple::sim::linear_solver {

// An elimination tree cut for two threads: subtrees shared out to two branches, which know nothing of each other, and the trunk that
// both end in.
struct TreeCut {
  std::vector<int> branch;   // one a node: 0 or 1, -1: the trunk
  double longest_share = 1;  // of all work that one after the other has to be done at least, 0.5 to 1
};

// parent: of each node one after it, -1: none. work: of each node. All is trunk where two branches are not worth it.
TreeCut cut_tree(std::span<const int> parent, std::span<const std::size_t> work);

}  // namespace crumple::sim::linear_solver
