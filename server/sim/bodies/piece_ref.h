#pragma once

namespace crumple::sim {

// Where a node or a tet of the scene's mesh of a finite-element body is: in which of the body's pieces (fem_object.h), and which
// one of that piece. Piece 0 is the mesh that the body started as, or what is left of it.
struct NodeRef {
  int piece = 0;
  int node = 0;
};
struct TetRef {
  int piece = 0;
  int tet = 0;
};

}  // namespace crumple::sim
