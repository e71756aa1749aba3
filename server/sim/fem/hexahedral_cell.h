#pragma once

#include "common/types.h"
#include "server/sim/fem/hexahedron.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace crumple::sim::fem {

struct RestBody;

// Which tets make hexahedra: six around an edge that is a cell's inner diagonal, as Kuhn lattices have them, of one material. They may
// be as thin as panes are: tets of such a cell have a clamped basis, the cell has not. Diagonals are tried by length, the longest
// first, and no tet is in two. A crack along the faces of cells leaves them whole; one through a cell leaves its tets by themselves
// for ever. Nodes keep the masses that the tets give them: so a crack changes none.
//
// A cell sees the strain of its bending, and fracture the stress of that at each of its tets; but the law sees the mean alone, so that
// bending would flow too late: materials that yield are refused (make_rest_body).
struct HexahedralCells {
  // One a tet; in no cell: shape -1.
  std::vector<std::array<std::uint8_t, 4>> corner;  // of its cell, of each of its nodes
  std::vector<std::uint8_t> order;                  // which of its cell's tets it is
  std::vector<int> shape;                           // into shapes
  std::vector<HexahedronShape> shapes;              // each once, however many cells have it

  bool empty() const { return shapes.empty(); }
};

// Finds them and makes rest.macros of them and of the tets that are left. rest: geometry and materials of `tets`. How many there are.
int make_cells(const std::vector<Tet>& tets, RestBody& rest);

// As regroup(), of a body of hexahedra. before: two a tet, what each was part of.
void regroup_cells(const std::vector<Tet>& tets, std::span<const int> before, RestBody& rest);

}  // namespace crumple::sim::fem
