#include "server/sim/mesh/splinters.h"

#include "common/text.h"

#include <algorithm>

namespace crumple::sim {

Result<void> validate(const SplinterMesh& mesh, const std::string& field) {
  if (auto valid = validate(mesh.surface, field + ".surface"); !valid) return valid;
  if (mesh.splinter.size() != mesh.surface.vertices.size())
    return invalid(field + ".splinter", text("holds ", mesh.splinter.size(), ", must hold one a vertex (", mesh.surface.vertices.size(), ")"));
  if (mesh.patch.size() != mesh.surface.triangles.size())
    return invalid(field + ".patch", text("holds ", mesh.patch.size(), ", must hold one a triangle (", mesh.surface.triangles.size(), ")"));
  const auto is_splinter = [&](int s) { return s >= 0 && s < mesh.count; };
  std::vector<char> has_vertex(std::max(mesh.count, 0), 0);
  for (std::size_t v = 0; v < mesh.splinter.size(); ++v) {
    if (!is_splinter(mesh.splinter[v]))
      return invalid(text(field, ".splinter[", v, "]"), text("is ", mesh.splinter[v], ", must be in [0, ", mesh.count, ")"));
    has_vertex[mesh.splinter[v]] = 1;
  }
  if (const auto none = std::ranges::find(has_vertex, 0); none != has_vertex.end())
    return invalid(field + ".splinter", text("gives no vertex to splinter ", none - has_vertex.begin(), ", must give each one some"));
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    const std::string at = text(field, ".patches[", p, "]");
    if (!is_splinter(mesh.patches[p].splinter)) return invalid(at, "is of no splinter");
    if (mesh.patches[p].others.empty()) return invalid(at, "lies against nothing, must lie against one at least");
    if (!std::ranges::all_of(mesh.patches[p].others, is_splinter)) return invalid(at, "lies against no splinter");
  }
  for (std::size_t t = 0; t < mesh.patch.size(); ++t) {
    const Triangle& corners = mesh.surface.triangles[t];
    const int own = mesh.splinter[corners[0]], patch = mesh.patch[t];
    if (mesh.splinter[corners[1]] != own || mesh.splinter[corners[2]] != own)
      return invalid(text(field, ".surface.triangles[", t, "]"), "has vertices of several splinters");
    if (patch < -1 || patch >= static_cast<int>(mesh.patches.size()))
      return invalid(text(field, ".patch[", t, "]"), text("is ", patch, ", must be in [-1, ", mesh.patches.size(), ")"));
    if (patch >= 0 && mesh.patches[patch].splinter != own)
      return invalid(text(field, ".patch[", t, "]"), text("is of splinter ", mesh.patches[patch].splinter, ", must be of ", own));
  }
  return {};
}

}  // namespace crumple::sim
