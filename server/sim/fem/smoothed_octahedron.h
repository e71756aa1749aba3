#pragma once

#include "server/sim/fem/macro_element.h"

#include <span>
#include <vector>

namespace crumple::sim::fem {

// Linear tets lock: a coarse beam of them bends half as far as it should. Here the deformation gradient is averaged over
// the tets around an edge before the law sees it (edge-smoothed finite elements: Liu & Nguyen-Thoi, Smoothed Finite
// Element Methods, 2010), and only around two edges of each tet, to each of which it gives half of its volume. On a BCC
// lattice those are its two long edges, and the four tets around one are an octahedron; there are half as many of these
// as tets. In any other mesh they are the two opposite edges that are longest together.
//
//   F = sum_t w_t F_t, w_t = fill_t V_t / sum fill V:   F = sum_a x_a g_a^T over the octahedron's corners a
//   f_a = -V Q sigma g_a - gamma_a z,   z = sum_a gamma_a x_a
//
// The averages do not see the two nodes at the ends of the edge move against those around it: on a periodic BCC lattice
// the two lattices slide through each other for nothing. z does: gamma (Flanagan & Belytschko, 1981) is the vector that
// takes the middle of the ends minus the mean of those around, less what an affine field has of that, and scaled so that
// it resists by kHourglassShare of what plain tets would.
//
// Tets stay together as long as they share faces around the edge and are of one material: what a crack parts, or where
// materials meet, are octahedra of fewer tets; of one tet, half a plain tet. A tet with a clamped basis stays alone.
inline constexpr double kHourglassShare = 0.05;
// Averages let a mirrored or folded tet be. Where a tet has less of its rest volume, or deviates by more from the average, in
// |F_t - F| (of closed octahedra: by as much as z sees), the tets of the octahedron stand for themselves. Energy jumps there,
// so the second bound is out of the reach of bending: at 0.3 a beam that sags by eight tenths of its length gained 87 J in 30 s
// of BDF2 on a swing of 36 J, at 0.6 nothing. Of 200 scrambled cubes one then stays folded, as with 0.3 (of plain tets four); with
// no such bound it is one in fifteen.
inline constexpr double kSplitVolume = 0.2;
inline constexpr double kSplitDeviation = 0.6;
// |z|^2, times V mu, where the ends of a closed octahedron slide by s so that tets deviate by 2 s / h = kSplitDeviation.
inline constexpr double kSplitSlide = kSplitDeviation * kSplitDeviation * 2 * kHourglassShare;

// Pairs of opposite edges of a tet, by local nodes.
inline constexpr int kPairings[3][2][2] = {{{0, 1}, {2, 3}}, {{0, 2}, {1, 3}}, {{0, 3}, {1, 2}}};

// Chooses the edges of each tet and groups them. rest: geometry and materials of `tets`.
void make_octahedra(const std::vector<Tet>& tets, RestBody& rest);

// Groups anew by the slots of each tet (MacroElements::of_tet): as regroup(), of a body of octahedra.
void regroup_octahedra(const std::vector<Tet>& tets, std::span<const int> before, RestBody& rest);

}  // namespace crumple::sim::fem
