#pragma once

#include "common/types.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::fem {

struct RestBody;

// Which elements a body is made of.
enum class ElementKind {
  linear_tetrahedra,   // the paper's
  smoothed_octahedra,  // strain averaged around long edges: less stiff than the mesh is coarse
};

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

// Constant data, but for regroup(). Empty: the body's elements are its tets.
struct SmoothedOctahedra {
  std::vector<std::uint8_t> pairing;  // one a tet, into kPairings
  std::vector<int> of_tet;            // two a tet: the octahedra of its two edges

  // One an octahedron; the first `closed` are of four tets all around an edge.
  int closed = 0;
  std::vector<int> tet_start;         // count + 1, into tets
  std::vector<int> corner_start;      // count + 1, into corners
  std::vector<double> volume;         // sum of fill V / 2 [m^3]
  std::vector<int> tets;
  // One a corner: the two ends, then those around; of closed octahedra in order, tet k between around k and k + 1.
  std::vector<int> nodes;
  std::vector<Vec3> core;             // -sqrt(V) g_a [sqrt(m)], as RestBody::core
  std::vector<double> gamma;          // [sqrt(N/m)]

  int count() const { return static_cast<int>(volume.size()); }
  int first_tet(int d) const { return tets[tet_start[d]]; }  // all of one material
  bool empty() const { return volume.empty(); }
};

// Pairs of opposite edges of a tet, by local nodes.
inline constexpr int kPairings[3][2][2] = {{{0, 1}, {2, 3}}, {{0, 2}, {1, 3}}, {{0, 3}, {1, 2}}};

// Chooses the edges of each tet and groups them. rest: geometry and materials of `tets`.
void make_octahedra(const std::vector<Tet>& tets, RestBody& rest);

// Groups anew after splits or after tets left, which only ever parts octahedra. Returns for each the one that it was part
// of before, to hand plastic strain on. rest.octahedra.pairing and of_tet must be those of `tets` (keep_tets).
std::vector<int> regroup(const std::vector<Tet>& tets, RestBody& rest);
// Plastic strain of the octahedra after that, from what it was of those before.
std::vector<Mat3> inherited(const std::vector<Mat3>& plastic_strain, const std::vector<int>& before);

}  // namespace crumple::sim::fem
