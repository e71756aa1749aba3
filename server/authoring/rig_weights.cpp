#include "server/authoring/rig_weights.h"

#include "common/text.h"
#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/handle_weights.h"

namespace crumple::authoring {

Result<PointWeights> rig_weights(const sim::TetMesh& mesh, std::span<const Vec3> handles, RigWeights kind,
                                 double reach) {
  if (kind == RigWeights::gaussian) return PointWeights{handle_weights(mesh.X, handles), {}};
  Handles points;
  for (const Vec3& p : handles) points.handles.push_back(Handle::point(p));
  auto solved = bounded_biharmonic_weights(mesh, points, {.reach = reach});
  if (!solved) return std::unexpected(solved.error());
  PointWeights out{std::move(solved->W), {}};
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
