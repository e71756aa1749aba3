#include "server/authoring/rig_from_shapes.h"

#include "common/text.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/surface_samples.h"
#include "server/authoring/tet_laplacian.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crumple::authoring {
namespace {

Result<void> check(const ShapeRigOptions& o, size_t shapes) {
  using sim::example_based::kMaxBones;
  if (shapes == 0) return invalid("shapes", "is empty, must hold at least one shape");
  if (!(o.tolerance > 0 && o.tolerance <= 1))
    return invalid("tolerance", text("is ", o.tolerance, ", must be in (0, 1]"));
  if (o.most_handles < 1 || o.most_handles > kMaxBones)
    return invalid("most_handles", text("is ", o.most_handles, ", must be in [1, ", kMaxBones, "]"));
  if (o.first_handles < 1 || o.first_handles > o.most_handles)
    return invalid("first_handles", text("is ", o.first_handles, ", must be in [1, ", o.most_handles, "]"));
  return {};
}

double worst_relative(const std::vector<FittedPose>& poses) {
  double worst = 0;
  for (const FittedPose& pose : poses) worst = std::max(worst, pose.residual.relative());
  return worst;
}

// What is left over at each vertex, in parts of its shape's displacement, the worst of all shapes.
std::vector<double> relative_errors(const std::vector<FittedPose>& poses) {
  std::vector<double> out(poses.front().left_over.size(), 0.0);
  for (const FittedPose& pose : poses)
    if (pose.residual.displacement_rms > 0)
      for (size_t v = 0; v < out.size(); ++v)
        out[v] = std::max(out[v], pose.left_over[v].norm() / pose.residual.displacement_rms);
  return out;
}

// At most `count` points more, at free nodes near the worst vertices, each half as far from all others as handles are
// apart when `total` of them are spread over the box.
int add_points(const sim::TetMesh& mesh, const std::vector<int>& nodes, const std::vector<Vec3>& rest,
               const std::vector<double>& errors, int count, int total, Handles& handles) {
  Eigen::AlignedBox3d box;
  for (const Vec3& X : mesh.X) box.extend(X);
  const double apart = 0.5 * box.diagonal().norm() / std::sqrt(static_cast<double>(total));
  std::vector<int> by_error(errors.size());
  std::iota(by_error.begin(), by_error.end(), 0);
  std::ranges::stable_sort(by_error, std::ranges::greater{}, [&](int v) { return errors[v]; });
  std::vector<Vec3> fresh;
  const auto too_near = [&](const Vec3& p) {
    const auto is_near = [&](const Vec3& q) { return (p - q).norm() < apart; };
    const auto same = [&](const Handle& h) { return h.from == p || h.to == p; };
    return std::ranges::any_of(fresh, is_near) || std::ranges::any_of(handles.handles, same);
  };
  for (const int v : by_error) {
    if (static_cast<int>(fresh.size()) == count || !(errors[v] > 0)) break;
    const Vec3& wanted = rest[v];
    const int node = *std::ranges::min_element(nodes, {}, [&](int i) { return (mesh.X[i] - wanted).squaredNorm(); });
    if (!too_near(mesh.X[node])) fresh.push_back(mesh.X[node]);
  }
  for (const Vec3& p : fresh) handles.handles.push_back(Handle::point(p));
  return static_cast<int>(fresh.size());
}

}  // namespace

Result<ShapeRig> rig_from_shapes(const sim::TetMesh& mesh, const sim::SurfaceMesh& surface,
                                 const std::vector<DeformedShape>& shapes, const Handles& given,
                                 const ShapeRigOptions& options) {
  if (auto ok = check(options, shapes.size()); !ok) return std::unexpected(ok.error());
  if (auto ok = sim::validate(mesh, "mesh"); !ok) return std::unexpected(ok.error());
  if (auto ok = sim::validate(surface, "surface"); !ok) return std::unexpected(ok.error());
  const SurfaceSamples samples(surface, mean_edge_length(mesh));
  const std::vector<Vec3> rest = samples.at(surface.vertices);
  std::vector<DeformedShape> targets;
  for (size_t k = 0; k < shapes.size(); ++k) {
    if (shapes[k].vertices.size() != surface.vertices.size())
      return invalid(text("shapes[", k, "].vertices"),
                     text("holds ", shapes[k].vertices.size(), " vertices, must hold ", surface.vertices.size(),
                          " as the surface at rest"));
    targets.push_back({shapes[k].name, samples.at(shapes[k].vertices)});
  }
  const std::vector<int> nodes = surface_nodes(mesh.tets);
  Handles handles = given;
  if (handles.handles.empty())
    for (const int node : place_handles(mesh, nodes, options.first_handles))
      handles.handles.push_back(Handle::point(mesh.X[node]));

  ShapeRig best;
  std::vector<ShapeRigRound> rounds;
  for (bool more = true; more;) {
    auto weights = bounded_biharmonic_weights(mesh, handles, options.weights);
    if (!weights) return std::unexpected(weights.error());
    const EmbeddedSkinning skinning(mesh, weights->W, rest);
    std::vector<FittedPose> poses;
    for (size_t k = 0; k < targets.size(); ++k) {
      auto pose = pose_from_shape(skinning, rest, targets[k], text("shapes[", k, "]"), options.turn_penalty);
      if (!pose) return std::unexpected(pose.error());
      poses.push_back(std::move(*pose));
    }
    const double relative = worst_relative(poses);
    const bool better = rounds.empty() || relative < worst_relative(best.poses);
    rounds.push_back({handles.count(), relative});
    const std::vector<double> errors = relative_errors(poses);
    if (better) best = {handles, std::move(weights->W), std::move(poses), {}, relative <= options.tolerance};
    const int room = std::min(options.most_handles - handles.count(), std::max(1, handles.count() / 4));
    more =
        !best.reached && room > 0 && add_points(mesh, nodes, rest, errors, room, handles.count() + room, handles) > 0;
  }
  best.rounds = std::move(rounds);
  return best;
}

}  // namespace crumple::authoring
