#include "server/authoring/rig.h"

#include "common/text.h"
#include "server/authoring/boundary_fit.h"
#include "server/authoring/convex_parts.h"
#include "server/authoring/handle_placement.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

// One side of the box pushed in over a bit less than the whole extent.
Dent side_dent(const Eigen::AlignedBox3d& box, int axis, bool from_max, double depth) {
  const double extent = box.sizes()[axis];
  const Vec3 direction = (from_max ? -1 : 1) * Vec3::Unit(axis);
  return {.direction = direction,
          .face = direction.dot(from_max ? box.max() : box.min()),
          .depth = depth * extent,
          .zone = 0.95 * extent,
          .centre = box.center(),
          .swell = 0.15};
}

Result<void> check_bones(int bones) {
  using sim::example_based::kMaxBones;
  if (bones < 1 || bones > kMaxBones) return invalid("bones", text("is ", bones, ", must be in [1, ", kMaxBones, "]"));
  return {};
}

}  // namespace

Result<Rig> make_rig(const sim::SurfaceMesh& surface, const EnclosingOptions& enclosing, const BonePlacement& place,
                     RigWeights weights) {
  const auto enclosed = enclosing_mesh(surface, enclosing);
  if (!enclosed) return std::unexpected(enclosed.error());
  Rig rig;
  rig.report = enclosed->report;
  rig.set.mesh = fitted_to_surface(*enclosed, surface);
  rig.surface = nodes_at_solid(rig.set.mesh, surface, 0.1 * rig.report.cell_size);
  rig.bones = place(rig.set.mesh, rig.surface);
  const int B = static_cast<int>(rig.bones.size());
  if (auto valid = check_bones(B); !valid) return std::unexpected(valid.error());
  Handles points;
  for (const Vec3& p : rig.bones) points.handles.push_back(Handle::point(p));
  auto weighed = rig_weights(rig.set.mesh, points, weights);
  if (!weighed) return std::unexpected(weighed.error());
  rig.set.W = std::move(weighed->W);
  rig.set.examples = {rest_example(B)};
  rig.set.render = surface;
  return rig;
}

Result<Rig> make_rig(const sim::SurfaceMesh& surface, const EnclosingOptions& enclosing, int bones,
                     RigWeights weights) {
  if (auto valid = check_bones(bones); !valid) return std::unexpected(valid.error());
  const auto place = [bones](const sim::TetMesh& mesh, const std::vector<int>& nodes) {
    return points_of(mesh, place_handles(mesh, nodes, bones));
  };
  return make_rig(surface, enclosing, place, weights);
}

void add_example(Rig& rig, const std::string& name, const PoseField& field, BoneRotations rotations) {
  rig.set.examples.push_back(fit_example(name, rig.set.W, rig.set.mesh.X, rig.bones, field, rotations));
}

int default_slabs(const Vec3& extent) {
  Vec3 sorted = extent;
  std::sort(sorted.begin(), sorted.end());
  return std::clamp(static_cast<int>(std::round(sorted[2] / std::max(sorted[1], 1e-3 * sorted[2]))), 1, 6);
}

std::vector<std::pair<std::string, PoseField>> crushed_sides(const Eigen::AlignedBox3d& box, double depth) {
  constexpr std::array kSides{"crushed_min_x", "crushed_max_x", "crushed_min_y",
                              "crushed_max_y", "crushed_min_z", "crushed_max_z"};
  std::vector<std::pair<std::string, PoseField>> out;
  for (int side = 0; side < 6; ++side)
    out.emplace_back(kSides[side], dent(side_dent(box, side / 2, side % 2 == 1, depth)));
  return out;
}

Result<sim::example_based::ExampleSet> make_default_asset(const sim::SurfaceMesh& surface,
                                                          const DefaultAssetOptions& options) {
  if (!(options.depth > 0 && options.depth <= 0.6))
    return invalid("depth", text("is ", options.depth, ", must be in (0, 0.6]"));
  if (options.convex_parts < 0 || options.convex_parts > 64)
    return invalid("convex_parts", text("is ", options.convex_parts, ", must be in [0, 64]"));
  auto rig = make_rig(surface, options.enclosing, options.bones, options.weights);
  if (!rig) return std::unexpected(rig.error());

  Eigen::AlignedBox3d box;
  for (const Vec3& p : rig->set.mesh.X) box.extend(p);
  for (const auto& [name, field] : crushed_sides(box, options.depth)) add_example(*rig, name, field);

  const int slabs = options.convex_parts > 0 ? options.convex_parts : default_slabs(box.sizes());
  rig->set.convex_parts =
      hull_parts_along_longest_axis(rig->set.mesh.X, rig->surface, slabs, rig->report.cell_size / 2);
  if (auto valid = sim::example_based::validate(rig->set, "asset"); !valid) return std::unexpected(valid.error());
  return std::move(rig->set);
}

}  // namespace crumple::authoring
