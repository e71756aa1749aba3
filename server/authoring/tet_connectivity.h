#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::authoring {

// Tet across the face opposite each local node; -1 at the boundary.
std::vector<std::array<int, 4>> face_neighbours(const std::vector<Tet>& tets);

// Parts that hang together by faces: the number of them, and the part of each tet (0 .. count - 1, in tet order).
struct FaceParts {
  int count = 0;
  std::vector<int> part;
};
FaceParts face_parts(const std::vector<std::array<int, 4>>& neighbours);

// Nodes whose tets do not hang together by faces that contain the node (parts that touch in an edge or a node).
std::vector<int> pinched_nodes(const std::vector<Tet>& tets, const std::vector<std::array<int, 4>>& neighbours,
                               int node_count);

}  // namespace crumple::authoring
