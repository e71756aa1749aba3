#pragma once

#include <Eigen/Geometry>

#include <span>
#include <utility>
#include <vector>

// Which axis-aligned boxes meet [Parker & O'Brien 2009, section 6; Baraff 1992]. Boxes are sorted along the axis on which
// they are spread most and swept; unlike the paper's, the order is found anew each step: a sort of what is near a contact
// is a small part of a step, and no list has to be carried through snapshots and fracture.
namespace crumple::sim::contact {

using Box3 = Eigen::AlignedBox3d;
using IndexPair = std::pair<int, int>;

// All pairs (i < j) of boxes that overlap or touch, ascending. Empty and non-finite boxes meet nothing.
std::vector<IndexPair> sweep_and_prune(std::span<const Box3> boxes);
void sweep_and_prune(std::span<const Box3> boxes, std::vector<IndexPair>& pairs);  // replaces `pairs`

// All pairs (i, j) with boxes a[i] and b[j] overlapping or touching, ascending; replaces `pairs`.
// Of few, each is tried with each.
void sweep_and_prune(std::span<const Box3> a, std::span<const Box3> b, std::vector<IndexPair>& pairs);

}  // namespace crumple::sim::contact
