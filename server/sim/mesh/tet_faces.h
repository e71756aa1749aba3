#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::sim {

// Local node ids of the face opposite local node k, counter-clockwise seen from outside a tet of positive volume.
inline constexpr std::array<Triangle, 4> kTetFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

// One face of one tet under a key that does not depend on the tet: its node ids in ascending order.
struct FaceOfTet {
  Triangle key;  // ascending node ids
  int tet;
  int opposite;  // local index 0..3 of the node that is not on it

  bool same_face(const FaceOfTet& other) const { return key == other.key; }
};

// All 4 * tets.size() faces, ascending by (key, tet): tets that share a face stand side by side.
std::vector<FaceOfTet> sorted_faces(std::span<const Tet> tets);

}  // namespace crumple::sim
