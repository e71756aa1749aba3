#pragma once

#include "server/authoring/convex_polygon.h"
#include "server/authoring/splinter_cells.h"
#include "server/sim/mesh/tet_tree.h"

#include <span>

namespace crumple::authoring {

// What a convex cell leaves of one tet: a convex solid by its faces.
struct TetPiece {
  struct Face {
    int label;                // wall of the cell, or -1 - k: of the tet's own face opposite its corner k
    std::vector<int> points;  // counter-clockwise seen from outside
  };
  int tet;
  std::vector<Face> faces;
};

// What a cell leaves of a mesh. Pieces of tets that share a face have the same points on it.
struct TetPieces {
  std::vector<Vec3> points;  // [m]
  std::vector<TetPiece> pieces;
  std::vector<Tet> tets;   // the pieces in tets that meet face to face, each corner a point
  std::vector<int> piece;  // of each tet

  Polygon polygon(const TetPiece::Face& face) const;
};

// Faces are fanned from their lowest point, pieces from theirs, so that what lies on either side of a face fits. Pieces
// and tets thinner than 1e-10 of their size cubed, which rounding makes, are left out. tree: of `mesh`.
TetPieces tet_pieces(const sim::TetMesh& mesh, const sim::TetTree& tree, const SplinterCell& cell);

}  // namespace crumple::authoring
