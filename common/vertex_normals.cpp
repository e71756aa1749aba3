#include "common/vertex_normals.h"

#include <algorithm>
#include <cassert>

namespace crumple {

void vertex_normals(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::vector<Vec3f>& normals) {
  normals.assign(positions.size(), Vec3f::Zero());
  for (const auto& [a, b, c] : triangles) {
    assert(std::max({a, b, c}) < static_cast<int>(positions.size()) && std::min({a, b, c}) >= 0);
    const Vec3f area = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    for (const int v : {a, b, c}) normals[v] += area;
  }
  for (Vec3f& n : normals) n = n.stableNormalized();  // zero stays zero
}

}  // namespace crumple
