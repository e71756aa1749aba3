#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::sim::fem {

struct RestBody;

// Where a material hardly changes its volume, elements of a few tets lock: each of them keeps its own, and then there is little
// left that they can do. Above this Poisson's ratio a body of smoothed octahedra keeps it in patches: an element has a lambda of
// mu only (Poisson's ratio 1/4), and the rest of lambda acts on the mean of some six tets,
//
//   F = sum_t w_t F_t, w_t = fill_t V_t / sum fill V:   theta = tr(Q^T F) - 3 - sum_t w_t tr(eps^P_t),   f_a = -V lambda theta Q g_a,
//
// Q the rotation of that F, which is -dE/dx of V lambda / 2 theta^2. (Patches of simplices that share one volume ratio: de Souza Neto,
// Andrade Pires & Owen, Int. J. Num. Meth. Eng. 62, 2005.) Averages over the tets of each node, which that literature has as
// well, cost twice as many blocks and leave half as much again of the error: docs/lab.md.
//
// About one patch to a node is what three unknowns to a node can bear. Patches are the tets around an edge, the longest first, none in
// two; what is left over joins them. On a Kuhn lattice they are its cells. Their tets are of one material and connected by faces; a
// crack parts them. A patch's F does not divide by the volume of a tet, so that slivers with a clamped basis (linear_tetrahedron.h) are
// welcome; but those that are left alone would be as stiff as clamping forbids, and do with the element's lambda.
inline constexpr double kNearlyIncompressible = 0.4;

// Constant data, but for regroup_patches(). Empty: no material of the body asks for them, or all of its tets are clamped.
struct PressurePatches {
  std::vector<int> of_tet;        // one a tet: its patch; -1: none
  // One a patch.
  std::vector<int> tet_start;     // count + 1, into tets
  std::vector<int> corner_start;  // count + 1, into nodes and core
  std::vector<double> volume;     // sum of fill V [m^3]
  std::vector<int> tets;          // ascending in a patch
  // One a corner, ascending in a patch.
  std::vector<int> nodes;
  std::vector<Vec3> core;         // -sqrt(V) g_a [sqrt(m)]

  int count() const { return static_cast<int>(volume.size()); }
  int first_tet(int p) const { return tets[tet_start[p]]; }  // all of one material
  bool empty() const { return volume.empty(); }
};

// rest: geometry and materials of `tets`.
void make_patches(const std::vector<Tet>& tets, RestBody& rest);
// Groups anew after splits or after tets left, which only ever parts patches. of_tet must be that of `tets` (keep_tets).
void regroup_patches(const std::vector<Tet>& tets, RestBody& rest);

}  // namespace crumple::sim::fem
