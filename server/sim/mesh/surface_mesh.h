#pragma once

#include "common/error.h"
#include "common/types.h"

#include <vector>

namespace crumple::sim {

// A triangle surface; may be open, in several parts, or self-intersecting.
struct SurfaceMesh {
  std::vector<Vec3> vertices;       // [m]
  std::vector<Triangle> triangles;  // counter-clockwise seen from outside
};

// Rejects an empty mesh, non-finite vertices, ids out of range, more than 5 million triangles.
Result<void> validate(const SurfaceMesh& mesh, const std::string& field);

}  // namespace crumple::sim
