#pragma once

#include "server/sim/fem/hexahedral_cell.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::fem {

struct RestBody;

// Which elements a body is made of.
enum class ElementKind {
  linear_tetrahedra,   // the paper's
  smoothed_octahedra,  // strain averaged around long edges: less stiff than the mesh is coarse
  hexahedra,           // cells of six tets bend and twist as one (hexahedral_cell.h)
};

// Elements that are several tets each: smoothed octahedra (smoothed_octahedron.h), or hexahedra (hexahedral_cell.h) and the tets
// that are in none. The law sees the mean deformation gradient of an element's tets,
//
//   F = sum_t w_t F_t, w_t = fill_t V_t / sum fill V:   F = sum_a x_a g_a^T over the element's corners a
//
// and what the mean does not see is held by hourglass forces: of octahedra those of one vector gamma, of hexahedra a matrix.
//
// Constant data, but for regroup(). Empty: the body's elements are its tets.
struct MacroElements {
  // One a tet. Octahedra: into kPairings. A body has either of these.
  std::vector<std::uint8_t> pairing;
  HexahedralCells cells;

  std::vector<int> of_tet;            // two a tet: the elements that it gives half of itself to; of hexahedra twice the same

  // One an element; the first `closed` are octahedra of four tets all around an edge, or the first `hexahedra` hexahedra.
  int closed = 0;
  int hexahedra = 0;
  std::vector<int> tet_start;         // count + 1, into tets
  std::vector<int> corner_start;      // count + 1, into corners
  std::vector<double> volume;         // sum of w_t's share of fill V [m^3]
  std::vector<int> tets;              // of hexahedra in the order of HexahedronShape::deviation
  // One a corner. Octahedra: the two ends of the edge, then those around; of closed ones in order, tet k between around k and k + 1.
  // Hexahedra: as hexahedron.h has them.
  std::vector<int> nodes;
  std::vector<Vec3> core;             // -sqrt(V) g_a [sqrt(m)], as RestBody::core
  std::vector<double> gamma;          // [sqrt(N/m)]; 0 of hexahedra

  int count() const { return static_cast<int>(volume.size()); }
  int first_tet(int d) const { return tets[tet_start[d]]; }  // all of one material
  bool empty() const { return of_tet.empty(); }
  const HexahedronShape& shape(int d) const { return cells.shapes[cells.shape[first_tet(d)]]; }  // of a hexahedron
};

// Groups anew after splits or after tets left, which only ever parts elements. Returns for each the one that it was part
// of before, to hand plastic strain on. What is one a tet must be that of `tets` (keep_tets).
std::vector<int> regroup(const std::vector<Tet>& tets, RestBody& rest);
// Plastic strain of the elements after that, from what it was of those before.
std::vector<Mat3> inherited(const std::vector<Mat3>& plastic_strain, const std::vector<int>& before);

}  // namespace crumple::sim::fem
