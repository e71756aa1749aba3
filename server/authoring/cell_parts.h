#pragma once

#include "server/authoring/tet_pieces.h"

#include <map>

namespace crumple::authoring {

// What a cell leaves of a mesh, in parts that hang together by faces.
struct CellParts {
  TetPieces cut;
  std::map<int, int> piece_of;                     // of tets
  std::vector<int> part;                           // of each piece: 0 and on, by their first pieces
  std::vector<std::vector<TetPiece::Face>> walls;  // of each piece: faces on the cell's walls, labelled by wall
  int parts = 0;
};

// neighbours: of the mesh's tets (face_neighbours). tree: of the mesh.
CellParts cell_parts(const sim::TetMesh& mesh, const sim::TetTree& tree,
                     const std::vector<std::array<int, 4>>& neighbours, const SplinterCell& cell);

// Whether a polygon has an area that is more than rounding: 1e-9 of its size squared.
bool is_face(const Polygon& polygon);

}  // namespace crumple::authoring
