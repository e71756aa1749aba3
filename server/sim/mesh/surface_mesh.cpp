#include "server/sim/mesh/surface_mesh.h"

#include "common/text.h"

namespace crumple::sim {

Result<void> validate(const SurfaceMesh& mesh, const std::string& field) {
  constexpr std::size_t kMaxTriangles = 5'000'000;
  const std::size_t vertices = mesh.vertices.size(), triangles = mesh.triangles.size();
  if (vertices == 0) return invalid(field + ".vertices", "is empty");
  if (triangles == 0) return invalid(field + ".triangles", "is empty");
  if (triangles > kMaxTriangles)
    return invalid(field + ".triangles", text("holds ", triangles, ", must hold at most ", kMaxTriangles));
  if (vertices > 3 * kMaxTriangles)
    return invalid(field + ".vertices", text("holds ", vertices, ", must hold at most ", 3 * kMaxTriangles));
  for (std::size_t v = 0; v < vertices; ++v)
    if (!mesh.vertices[v].allFinite()) return invalid(text(field, ".vertices[", v, "]"), "is not finite");
  for (std::size_t t = 0; t < triangles; ++t)
    for (const int v : mesh.triangles[t])
      if (v < 0 || v >= static_cast<int>(vertices))
        return invalid(text(field, ".triangles[", t, "]"), text("names vertex ", v, ", must be in [0, ", vertices, ")"));
  return {};
}

}  // namespace crumple::sim
