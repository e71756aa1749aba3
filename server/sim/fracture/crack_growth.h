#pragma once

#include "server/sim/fracture/node_splitter.h"

// The order of splits that Parker & O'Brien (2009, section 5) name as the ideal one, with O'Brien & Hodgins (1999):
// largest eigenvalue first, residual propagation, and separation formed anew around what a split affected.
namespace crumple::sim::fracture {

// Splits the node of the largest strength over toughness (of equal ones the least id), then looks anew at all nodes of
// the tets around it and its copy, which may leave the queue or enter it; and so on, until none is over its toughness
// or max_splits are made. Any number of threads, any seed: the same bits.
// Parker & O'Brien give no equations for it; these are ours. Tets are not cut here and positions do not move within a
// step, so that by itself a split changes the tensor of no other node, and with nothing but the order a body that is
// overloaded all over takes more splits than in the random one. So a split of plane normal n, eigenvalue lambda and
// A = A(n) brings:
//   Relief: new faces are free of traction. The tets around node and copy no longer carry tension across the plane,
//     sigma+ := P sigma+ P, P = I - n n^T; compression stays, a crack that is pressed shut bears it. Tets tougher than
//     the candidate are not cut by it and keep theirs.
//   Residual: nodes at which the crack ends keep the S of before the relief, since a crack that comes nearer unloads
//     nothing ahead of it, and get n n^T (lambda - toughness A) / k each, k their number: what the node bore beyond its
//     toughness is handed on, once. (Whole to each, the load grows as the crack branches and shatters what is held.)
// Both last for the call; the next solve knows better. Relief reaches one tet far, and only what pulls across the plane:
// where all of a body is overloaded cracks run side by side, and where it is pulled both ways also across each other.
// candidates: split_candidates of these stresses. stress, normals, forces: as separation_tensors has them; stress and
// forces are changed. A split costs O(its star).
SplitReport grow_cracks(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const Toughness& toughness,
                        std::span<const Mat34> normals, int max_splits, std::span<Mat3> stress, PartForces& forces);

}  // namespace crumple::sim::fracture
