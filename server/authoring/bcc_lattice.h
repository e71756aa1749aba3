#pragma once

#include "common/types.h"

#include <cstdint>

namespace crumple::authoring {

// The body-centred cubic lattice cut into tetrahedra: two interleaved cubic lattices (cell corners and cell centres),
// and around each edge that joins the centres of two neighbouring cells four tets, each made of the two centres and of
// two neighbouring corners of the face between the cells. All tets are congruent: volume h^3 / 12, dihedral angles
// 60 and 90 degrees, two long edges (h) and four short ones (sqrt(3)/2 h).
struct BccLattice {
  Vec3 origin;               // minimum corner of cell (0, 0, 0) [m]
  double h;                  // cell size [m]
  std::array<int, 3> cells;  // cells along x, y, z

  std::int64_t cell_count() const { return std::int64_t{cells[0]} * cells[1] * cells[2]; }
  // Ids run over all (cell, axis, quarter); those of a last cell along the axis do not exist.
  std::int64_t tet_slots() const { return 12 * cell_count(); }
  std::int64_t node_slots() const {
    return std::int64_t{cells[0] + 1} * (cells[1] + 1) * (cells[2] + 1) + cell_count();
  }

  // Tet `quarter` (0..3) around the edge from the centre of cell c to that of its neighbour along `axis`.
  std::int64_t tet_id(const std::array<int, 3>& c, int axis, int quarter) const;
  bool exists(std::int64_t tet) const;

  std::array<std::int64_t, 4> nodes(std::int64_t tet) const;  // node ids, positive volume
  std::array<Vec3, 4> unit_corners(const std::array<int, 3>& c, int axis, int quarter) const;  // in cells, from origin
  std::array<Vec3, 4> corners(std::int64_t tet) const;                                         // [m]
  Vec3 position(std::int64_t node) const;                                                      // [m]

  struct Slot {
    std::array<int, 3> cell;
    int axis, quarter;
  };
  Slot slot(std::int64_t tet) const;
};

}  // namespace crumple::authoring
