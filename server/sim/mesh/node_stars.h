#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::sim {

// The tets around each node, ascending by id. Built in time linear in the mesh; follows the splitting of nodes at the
// cost of the star alone, and is then the same as if it were built anew.
class NodeStars {
 public:
  NodeStars() = default;
  NodeStars(std::span<const Tet> tets, int node_count);

  int node_count() const { return static_cast<int>(begin_.size()); }
  std::span<const int> operator[](int node) const {
    return {tets_.data() + begin_[node], static_cast<std::size_t>(end_[node] - begin_[node])};
  }

  // Hands the tets of `node` that `moves(tet)` accepts over to a new node, whose id is returned. The tets themselves
  // are the caller's to change.
  template <class Predicate>
  int split(int node, Predicate moves);

  // Takes the last split() back, which must have been of `node`.
  void undo_split(int node);

 private:
  std::vector<int> begin_, end_;  // one a node: its range of tets_
  std::vector<int> tets_;         // 4 a tet
  std::vector<int> moved_;        // scratch of split()
};

template <class Predicate>
int NodeStars::split(int node, Predicate moves) {
  moved_.clear();
  int kept = begin_[node];
  for (int i = begin_[node]; i < end_[node]; ++i) {
    const int t = tets_[i];
    if (moves(t)) moved_.push_back(t);
    else tets_[kept++] = t;
  }
  for (std::size_t i = 0; i < moved_.size(); ++i) tets_[kept + i] = moved_[i];
  begin_.push_back(kept);
  end_.push_back(end_[node]);
  end_[node] = kept;
  return node_count() - 1;
}

}  // namespace crumple::sim
