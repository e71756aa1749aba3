#include "server/authoring/rig_weights.h"

#include "common/text.h"
#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/handle_weights.h"

namespace crumple::authoring {

Result<RigWeighing> rig_weights(const sim::TetMesh& mesh, const Handles& handles, RigWeights kind, double reach) {
  if (kind == RigWeights::gaussian) {
    std::vector<Vec3> points;
    for (const Handle& h : handles.handles) points.push_back(h.from);
    return RigWeighing{handle_weights(mesh.X, points), {}};
  }
  auto solved = bounded_biharmonic_weights(mesh, handles, {.reach = reach});
  if (!solved) return std::unexpected(solved.error());
  RigWeighing out{std::move(solved->W), {}};
  const BiharmonicReport& report = solved->report;
  if (!report.converged)
    out.warnings.push_back(text("the weights did not converge in ", report.iterations, " iterations; they are valid"));
  if (report.components_without_handle > 0)
    out.warnings.push_back(text(report.components_without_handle, " of ", report.components,
                                " parts of the tets have no handle: each moves as one with what is nearest"));
  if (report.shared_vertices > 0)
    out.warnings.push_back(
        text(report.shared_vertices,
             " nodes are the nearest of several handles, which share them; smaller cells part them"));
  return out;
}

}  // namespace crumple::authoring
