#include "server/sim/mesh/tet_mesh.h"

#include "common/text.h"
#include "server/sim/mesh/tet_faces.h"

#include <algorithm>

namespace crumple::sim {

Mat34 rest_corners(const TetMesh& mesh, int t) {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = mesh.X[mesh.tets[t][k]];
  return x;
}

double signed_volume(const TetMesh& mesh, int t) {
  const Tet& tet = mesh.tets[t];
  const Vec3& X0 = mesh.X[tet[0]];
  return (mesh.X[tet[1]] - X0).dot((mesh.X[tet[2]] - X0).cross(mesh.X[tet[3]] - X0)) / 6;
}

std::vector<SurfaceFace> surface_faces(const std::vector<Tet>& tets) {
  const std::vector<FaceOfTet> faces = sorted_faces(tets);
  std::vector<bool> on_surface(faces.size(), false);  // by 4 tet + opposite: mesh order
  for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
    while (j < faces.size() && faces[j].same_face(faces[i])) ++j;
    if (j == i + 1) on_surface[4 * static_cast<std::size_t>(faces[i].tet) + faces[i].opposite] = true;
  }
  std::vector<SurfaceFace> surface;
  for (std::size_t i = 0; i < on_surface.size(); ++i) {
    if (!on_surface[i]) continue;
    const int t = static_cast<int>(i / 4), k = static_cast<int>(i % 4);
    const Triangle& local = kTetFaces[k];
    surface.push_back({{tets[t][local[0]], tets[t][local[1]], tets[t][local[2]]}, t, k});
  }
  return surface;
}

namespace {

double longest_edge(const TetMesh& mesh, const Tet& tet) {
  double longest = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) longest = std::max(longest, (mesh.X[tet[a]] - mesh.X[tet[b]]).norm());
  return longest;
}

Result<void> validate_tet(const TetMesh& mesh, int t, const std::string& field) {
  const Tet& tet = mesh.tets[t];
  const auto path = [&] { return text(field, ".tets[", t, "]"); };
  for (int k = 0; k < 4; ++k) {
    if (tet[k] < 0 || tet[k] >= mesh.node_count())
      return invalid(path(), text("names node ", tet[k], ", must be in [0, ", mesh.node_count(), ")"));
    for (int j = 0; j < k; ++j)
      if (tet[j] == tet[k]) return invalid(path(), text("names node ", tet[k], " twice"));
  }
  const double L = longest_edge(mesh, tet), volume = signed_volume(mesh, t);
  if (!(volume > 1e-12 * L * L * L))  // also where the products overflow
    return invalid(path(), text("has volume ", volume, ", must be above 1e-12 of its longest edge (", L, ") cubed"));
  return {};
}

}  // namespace

Result<void> validate(const TetMesh& mesh, const std::string& field) {
  constexpr std::size_t kMax = kMaxTets;
  const std::size_t tets = mesh.tets.size(), nodes = mesh.X.size(), fills = mesh.fill.size();
  if (tets == 0) return invalid(field + ".tets", "is empty, must hold at least one tet");
  if (tets > kMax) return invalid(field + ".tets", text("holds ", tets, " tets, must hold at most ", kMax));
  if (nodes > 4 * kMax) return invalid(field + ".X", text("holds ", nodes, " nodes, must hold at most ", 4 * kMax));
  for (std::size_t n = 0; n < nodes; ++n)
    if (!mesh.X[n].allFinite()) return invalid(text(field, ".X[", n, "]"), "is not finite");
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (auto ok = validate_tet(mesh, t, field); !ok) return ok;
  if (fills != 0 && fills != tets)
    return invalid(field + ".fill", text("holds ", fills, " values, must hold none or one a tet (", tets, ")"));
  if (!mesh.tags.empty() && mesh.tags.size() != tets)
    return invalid(field + ".tags", text("holds ", mesh.tags.size(), " values, must hold none or one a tet (", tets, ")"));
  for (std::size_t t = 0; t < fills; ++t)
    if (!(mesh.fill[t] > 0 && mesh.fill[t] <= 1))
      return invalid(text(field, ".fill[", t, "]"), text("is ", mesh.fill[t], ", must be in (0, 1]"));
  return {};
}

}  // namespace crumple::sim
