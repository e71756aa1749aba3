#pragma once

namespace crumple::sim {

// Where a node or a tet of a finite-element body is: in what is left of the body, or in a rigid fragment of it.
struct NodeRef {
  int fragment = -1;  // -1: still the body's
  int node = 0;
};
struct TetRef {
  int fragment = -1;
  int tet = 0;
};

}  // namespace crumple::sim
