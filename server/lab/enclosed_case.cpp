#include "server/lab/enclosed_case.h"

#include "common/text.h"
#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/splinter_cut.h"

#include <algorithm>
#include <limits>

namespace crumple::lab {

std::vector<Vec3> EnclosedCase::carried(std::span<const Vec3> displacements) const {
  std::vector<Vec3> out(embedding.tet.size());
  sim::embedded_positions(embedding, level.mesh.tets, displacements, out);
  return out;
}

Result<EnclosedCase> enclose(const Level& stored, const Vec3& gravity, double density, double cell_size) {
  if (!(gravity.norm() > 0)) return invalid("gravity", "is zero, must pull at what hangs");
  if (stored.dirichlet.empty()) return invalid("supports", "are none: what hangs must be held");
  auto made = authoring::enclosing_mesh(authoring::surface_of(stored.mesh), {.cell_size = cell_size});
  if (!made) return std::unexpected(made.error());
  EnclosedCase enclosed{.level = {.mesh = std::move(made->mesh)}};
  const sim::TetMesh& mesh = enclosed.level.mesh;
  const Vec3 down = gravity.normalized();
  double lowest = -std::numeric_limits<double>::infinity();
  for (const Dirichlet& d : stored.dirichlet) lowest = std::max(lowest, down.dot(stored.mesh.X[d.node]));
  for (int n = 0; n < mesh.node_count(); ++n) {
    if (down.dot(mesh.X[n]) >= lowest) continue;
    for (int dof = 0; dof < 3; ++dof) enclosed.level.dirichlet.push_back({n, dof, 0});
  }
  if (enclosed.level.dirichlet.empty()) return invalid("supports", text("hold no node of a lattice with cells of ", cell_size, " m"));

  enclosed.level.loads = Eigen::VectorXd::Zero(3 * mesh.node_count());
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Vec3 weight = density * mesh.fill[t] * sim::signed_volume(mesh, t) * gravity;
    for (int node : mesh.tets[t]) enclosed.level.loads.segment<3>(3 * node) += weight / 4;
  }
  enclosed.embedding = sim::embed(stored.mesh.X, mesh);
  return enclosed;
}

}  // namespace crumple::lab
