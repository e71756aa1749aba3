#pragma once

#include "server/authoring/cell_parts.h"
#include "server/authoring/prescored_parts.h"

namespace crumple::authoring {

// What lies against what, across the walls of cells. by_cell: what each cell left of the mesh; part_of[c][p]: the id
// among all parts of part p of cell c, -1: none. neighbours: of the mesh's tets. Ascending by (a, b).
std::vector<PrescoredFace> part_faces(const std::vector<std::array<int, 4>>& neighbours,
                                      const std::vector<SplinterCell>& cells, const std::vector<CellParts>& by_cell,
                                      const std::vector<std::vector<int>>& part_of);

}  // namespace crumple::authoring
