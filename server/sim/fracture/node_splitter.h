#pragma once

#include "server/sim/fem/fem_state.h"
#include "server/sim/fracture/separation_tensor.h"
#include "server/sim/mesh/node_stars.h"

#include <cstdint>
#include <span>
#include <vector>

// Breaking a tet mesh along its faces by replicating one node (Parker & O'Brien 2009, section 5).
namespace crumple::sim::fracture {

// A piece smaller than this many face-connected tets is never made.
inline constexpr int kMinFragmentTets = 3;

// One candidate that was split.
struct NodeSplit {
  int node;     // keeps the tets behind the plane
  int copy;     // has those in front of it
  Vec3 point;   // of the plane: the node's position, in W [m]
  Vec3 normal;  // of the plane, in W
};

struct SplitReport {
  std::vector<NodeSplit> splits;
  std::vector<int> origin;  // of each new node, in order of their ids: the node of before the call that it copies
  int separated = 0;        // further copies, made where only an edge or a node was left as a link
  int refused = 0;          // candidates that would have made a piece under kMinFragmentTets
};

// Splits candidates of a body, one a call, whichever order they come in. The tets of a candidate whose centroid lies in
// front of the plane go to a copy of the node; a candidate with all tets on one side stays whole.
// Refused: a split that would leave a piece under kMinFragmentTets tets; pieces born so stay as they are.
// Where a split leaves tets of a node that hang together by less than a face at that node, hence only by an edge
// (hinge) or by the node (ball joint), each face-connected group gets its own copy. The paper asks it of two
// components; here two parts of one component that touch in such a joint are parted too, since the check then needs the
// node's star alone. In a body of several materials the tets of the node that are tougher than the candidate, or never
// give way, stay together, on the side of the plane where the mean of their centroids lies: a crack in glass ends at
// the frame, or runs along it. Tets that never give way are not parted by joints either. Copies take position and
// velocity of their node; rest shape and plastic strain belong to tets and do not change. Mass and momentum stay the
// same once the caller has recomputed node masses from the tets; other arrays that have one entry a node follow by
// extend_by_origin. Refers to its arguments; stars: those of `tets`, kept up to date.
class NodeSplitter {
 public:
  NodeSplitter(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars, const Toughness& toughness);

  // Whether the candidate was split. Costs O(its star).
  bool split(const SplitCandidate& candidate);

  // Of the last split: itself; nodes that lost tets or got some (node, copy, what was a joint and its copies),
  // ascending; nodes at which the new crack ends, ascending.
  const NodeSplit& last() const { return report_.splits.back(); }
  std::span<const int> parted() const { return parted_; }
  std::span<const int> tips() const { return tips_; }

  int split_count() const { return static_cast<int>(report_.splits.size()); }
  const SplitReport& report() const { return report_; }

 private:
  // A face at a node, under the ids of its two other corners.
  struct FaceAtNode {
    std::uint64_t corners;  // the lower one first
    int index;              // of the tet in the node's star
    int low() const { return static_cast<int>(corners >> 32); }
    int high() const { return static_cast<int>(corners); }
    bool same_face(const FaceAtNode& other) const { return corners == other.corners; }
  };

  Vec3 centroid(int t) const;
  std::vector<char> in_front(const SplitCandidate& candidate) const;
  void list_faces_at(int node);
  void list_groups_at(int node);
  bool in_large_piece(int t) const;
  int replicate(int node, const std::vector<char>& moves);
  void merge_back(int node, int copy);
  bool separate_joints(int node);

  std::vector<Tet>& tets_;
  fem::FemState& state_;
  NodeStars& stars_;
  const Toughness& toughness_;
  SplitReport report_;
  int old_node_count_;
  std::vector<int> parted_, tips_;

  // Scratch.
  std::vector<FaceAtNode> faces_;  // of list_faces_at: those of one face side by side
  std::vector<int> group_;         // of list_groups_at: one a tet of the star, numbered by their lowest tet
  std::vector<char> moves_;        // one a tet of a star
  std::vector<int> cut_tets_;      // tets that lose a neighbour
  std::vector<int> cut_nodes_;     // nodes whose stars lose a face
};

// Gives an array with one entry a node the entries of the new nodes (rest positions, prescribed flags, ...).
template <class T>
void extend_by_origin(std::vector<T>& per_node, std::span<const int> origin) {
  per_node.reserve(per_node.size() + origin.size());
  for (const int node : origin) per_node.push_back(per_node[node]);
}

}  // namespace crumple::sim::fracture
