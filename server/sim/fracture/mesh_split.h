#pragma once

#include "server/sim/fem/fem_state.h"
#include "server/sim/fracture/separation_tensor.h"
#include "server/sim/mesh/node_stars.h"

#include <cstdint>
#include <span>
#include <vector>

// Breaking a tet mesh along its faces by replicating nodes (Parker & O'Brien 2009, section 5).
namespace crumple::sim::fracture {

// A piece smaller than this many face-connected tets is never made.
inline constexpr int kMinFragmentTets = 3;

struct SplitOptions {
  std::uint64_t seed = 1;  // with `step` it decides the order in which candidates are tried
  std::uint64_t step = 0;
  int max_splits = 200;    // candidates split in one call, at most
};

// One candidate that was split.
struct NodeSplit {
  int node;      // keeps the tets behind the plane
  int copy;      // has those in front of it
  Vec3 point;    // of the plane: the node's position, in W [m]
  Vec3 normal;   // of the plane, in W
};

struct SplitReport {
  std::vector<NodeSplit> splits;
  std::vector<int> origin;  // of each new node, in order of their ids: the node of before the call that it copies
  int separated = 0;        // further copies, made where only an edge or a node was left as a link
  int refused = 0;          // candidates that would have made a piece under kMinFragmentTets
  int fragments = 0;        // face-connected pieces afterwards; 0 if nothing was split
};

// Tries the candidates in an order that is random but set by seed, step and node ids alone. The tets of a candidate whose
// centroid lies in front of the plane go to a copy of the node; a candidate with all tets on one side stays whole. There
// is no residual propagation and no update of nearby nodes (the paper's simplifications).
// Refused: a split that would leave a piece under kMinFragmentTets tets; pieces born so stay as they are.
// Where a split leaves tets of a node that hang together by less than a face at that node, hence only by an edge (hinge)
// or by the node (ball joint), each face-connected group gets its own copy. The paper asks it of two components; here two
// parts of one component that touch in such a joint are parted too, since the check then needs the node's star alone.
// In a body of several materials the tets of the node that are tougher than the candidate, or never give way, stay
// together, on the side of the plane where the mean of their centroids lies: a crack in glass ends at the frame, or runs
// along it. Tets that never give way are not parted by joints either.
// Copies take position and velocity of their node; rest shape and plastic strain belong to tets and do not change.
// Mass and momentum stay the same once the caller has recomputed node masses from the tets; other arrays that have one
// entry a node follow by extend_by_origin. stars: those of `tets`; kept up to date. A candidate costs O(its star).
SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const Toughness& toughness,
                        const SplitOptions& options);
// Of a body of one material.
SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const SplitOptions& options);

// Gives an array with one entry a node the entries of the new nodes (rest positions, prescribed flags, ...).
template <class T>
void extend_by_origin(std::vector<T>& per_node, std::span<const int> origin) {
  per_node.reserve(per_node.size() + origin.size());
  for (const int node : origin) per_node.push_back(per_node[node]);
}

}  // namespace crumple::sim::fracture
