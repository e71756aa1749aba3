#pragma once

#include "common/types.h"
#include "server/sim/mesh/surface_mesh.h"

#include <vector>

namespace crumple::authoring {

// A binary tree of boxes over the triangles of a surface, split at the median of the longest axis (ties by triangle id,
// so that equal input gives an equal tree). Leaves hold at most kLeafTriangles.
struct TriangleBvh {
  static constexpr int kLeafTriangles = 4;

  struct Node {
    Vec3 lower, upper;  // box of the triangles below [m]
    int first, count;   // their range in `corners`
    int right = -1;     // right child; the left one is the next node; -1: a leaf
    bool leaf() const { return right < 0; }
  };

  std::vector<Node> nodes;                   // nodes[0] is the root; empty for an empty surface
  std::vector<std::array<Vec3, 3>> corners;  // triangle corners in tree order [m]
  std::vector<int> triangle;                 // their ids in the surface

  TriangleBvh() = default;
  explicit TriangleBvh(const sim::SurfaceMesh& surface);
};

}  // namespace crumple::authoring
