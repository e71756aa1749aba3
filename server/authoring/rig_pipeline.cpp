#include "server/authoring/rig_pipeline.h"

#include "common/text.h"
#include "server/authoring/boundary_fit.h"
#include "server/authoring/convex_parts.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/handle_stage.h"
#include "server/authoring/painted_regions.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/rig.h"
#include "server/authoring/surface_transfer.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::Example;
using sim::example_based::ExampleSet;
using sim::example_based::kMaxBones;
using Weights = RigOptions::Weights;

Result<void> check(const ArtistMesh& mesh, const RigOptions& o) {
  const std::size_t V = mesh.surface.vertices.size();
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.surface.vertices) box.extend(p);
  if (V > 0 && o.enclosing.cell_size > box.sizes().maxCoeff())
    return invalid("cell_size", text("is ", o.enclosing.cell_size, " m, must be at most ", box.sizes().maxCoeff(),
                                     " m, the surface's longest side"));
  if (!(o.crush_depth > 0 && o.crush_depth <= 0.6))
    return invalid("crush_depth", text("is ", o.crush_depth, ", must be in (0, 0.6]"));
  if (o.convex_parts < 0 || o.convex_parts > 64)
    return invalid("convex_parts", text("is ", o.convex_parts, ", must be in [0, 64]"));
  if (o.automatic_handles < -1 || o.automatic_handles > kMaxBones)
    return invalid("automatic_handles", text("is ", o.automatic_handles, ", must be in [0, ", kMaxBones, "]"));
  if (o.painted_regions && mesh.colours.size() != V)
    return invalid("painted_regions", "is asked for, but the mesh has no vertex colours (COLOR_0)");
  if (o.weights == Weights::painted && !is_painted(mesh))
    return invalid("weights", "are to be painted, but the mesh has no joint weights");
  if (o.weights == Weights::painted && (o.automatic_handles > 0 || !o.handles.empty()))
    return invalid("weights", "are to be painted beside handles that the mesh has not; they would have no weights");
  if (!(o.tolerance >= 0 && o.tolerance <= 1))
    return invalid("tolerance", text("is ", o.tolerance, ", must be in (0, 1], or 0 for none"));
  if (o.tolerance > 0 && (o.weights == Weights::painted || o.weights == Weights::gaussian))
    return invalid("tolerance",
                   "is asked for beside painted or Gaussian weights, must be with bounded biharmonic ones");
  if (o.tolerance > 0 && mesh.copies.empty())
    return invalid("tolerance", "is asked for, but the mesh has no deformed copies (morph targets)");
  if (o.most_handles < 1 || o.most_handles > kMaxBones)
    return invalid("most_handles", text("is ", o.most_handles, ", must be in [1, ", kMaxBones, "]"));
  for (const DeformedShape& copy : mesh.copies)
    if (copy.vertices.size() != V)
      return invalid("copies", text("\"", copy.name, "\" has ", copy.vertices.size(), " vertices, must have ", V,
                                    ", those of the surface"));
  return {};
}

void paint_regions(const std::vector<Vec3>& colours, const SurfaceTransfer& to_nodes, ExampleSet& set,
                   RigReport& report) {
  Eigen::MatrixXd channels(3, static_cast<Eigen::Index>(colours.size()));
  for (std::size_t i = 0; i < colours.size(); ++i) channels.col(static_cast<Eigen::Index>(i)) = colours[i];
  const Eigen::MatrixXd at_nodes = to_nodes(channels);
  for (Eigen::Index i = 0; i < at_nodes.cols(); ++i) {
    set.alpha_scale.push_back(region_scale(std::clamp(at_nodes(0, i), 0.0, 1.0)));
    set.beta_scale.push_back(region_scale(std::clamp(at_nodes(2, i), 0.0, 1.0)));
  }
  if (at_nodes.cols() > 0 && (channels.colwise() - channels.col(0)).cwiseAbs().maxCoeff() < 1e-3)
    report.warnings.push_back("the vertex colours are one colour everywhere: all of it is equally weak");
}

// Tets that enclose all vertices, and the nodes that the body collides by.
using Body = std::pair<sim::TetMesh, std::vector<int>>;

Body lattice_of(const EnclosingMesh& enclosing) { return {enclosing.mesh, surface_nodes(enclosing.mesh.tets)}; }

Body drawn_onto(const EnclosingMesh& enclosing, const sim::SurfaceMesh& surface, RigReport& report) {
  const double h = enclosing.report.cell_size;
  sim::TetMesh tets = fitted_to_surface(enclosing, surface);
  std::vector<int> solid = nodes_at_solid(tets, surface, 0.1 * h);
  if (solid.size() < 4) solid = surface_nodes(tets.tets);
  tets = pushed_around_vertices(std::move(tets), surface, h);
  const std::size_t outside = outside_vertices(tets, surface.vertices).size();
  if (outside == 0) return {std::move(tets), std::move(solid)};
  report.warnings.push_back(text("tets drawn onto the surface would leave ", outside, " of ", report.vertices,
                                 " vertices outside: they stay those of the lattice; smaller cells help"));
  return lattice_of(enclosing);
}

}  // namespace

Result<RiggedAsset> make_asset(const ArtistMesh& mesh, const RigOptions& o, const RigProgress& progress) {
  const auto stage = [&](double done, const std::string& name) {
    if (progress) progress(done, name);
  };
  if (auto valid = check(mesh, o); !valid) return std::unexpected(valid.error());
  RiggedAsset out;
  ExampleSet& set = out.set;
  RigReport& report = out.report;
  report.warnings = mesh.warnings;

  stage(0, "enclosing");
  const auto enclosed = enclosing_mesh(mesh.surface, o.enclosing);
  if (!enclosed) return std::unexpected(enclosed.error());
  report.enclosing = enclosed->report;
  report.vertices = static_cast<int>(mesh.surface.vertices.size());
  report.triangles = static_cast<int>(mesh.surface.triangles.size());
  set.render = mesh.surface;

  stage(0.3, "fitting the tets to the surface");
  auto [tets, surface] = o.keep_lattice ? lattice_of(*enclosed) : drawn_onto(*enclosed, mesh.surface, report);
  set.mesh = std::move(tets);
  report.nodes = set.mesh.node_count();
  report.tets = set.mesh.tet_count();
  report.vertices_enclosed = report.vertices - static_cast<int>(outside_vertices(set.mesh, set.render.vertices).size());
  if (report.enclosing.bodies > 1)
    report.warnings.push_back(text("the tets are ", report.enclosing.bodies,
                                   " parts that do not hang together; a larger cell size joins them"));

  stage(0.45, "placing handles");
  auto handles = all_handles(mesh, o, set.mesh, surface, report);
  if (!handles) return std::unexpected(handles.error());
  report.bones =
      static_cast<int>(std::ranges::count_if(handles->shapes.handles, [](const Handle& h) { return !h.is_point(); }));
  report.cage_edges = static_cast<int>(handles->shapes.cage_edges.size());
  report.cage_faces = static_cast<int>(handles->shapes.cage_faces.size());

  stage(0.5, "weights");
  const SurfaceTransfer to_nodes(mesh.surface, set.mesh.X);
  auto W = weights_of(mesh, o, set, *handles, to_nodes, report);
  if (!W) return std::unexpected(W.error());
  set.handles = std::move(handles->named);
  set.W = *std::move(W);
  if (o.painted_regions) paint_regions(mesh.colours, to_nodes, set, report);

  set.examples = {rest_example(set.bone_count())};
  ExampleAuthor author(set);
  const auto done = [&](Result<ExampleReport> example) -> Result<void> {
    if (!example) return std::unexpected(example.error());
    if (!example->converged)
      report.warnings.push_back("the pose of \"" + example->name +
                                "\" did not converge; it is the best that was found");
    report.examples.push_back(*std::move(example));
    return {};
  };
  for (const Example& pose : mesh.poses) {
    stage(0.7, "pose " + pose.name);
    if (auto added = done(author.add_animation(pose)); !added) return std::unexpected(added.error());
  }
  for (std::size_t c = 0; c < mesh.copies.size(); ++c) {
    stage(0.75 + 0.2 * static_cast<double>(c) / static_cast<double>(mesh.copies.size()),
          "fitting " + mesh.copies[c].name);
    if (auto added = done(author.add_copy(mesh.copies[c])); !added) return std::unexpected(added.error());
  }
  for (const NamedPose& pose : o.poses) {
    stage(0.95, "pose " + pose.name);
    if (auto added = done(author.add_pose(pose)); !added) return std::unexpected(added.error());
  }
  Eigen::AlignedBox3d box;
  for (const Vec3& p : set.mesh.X) box.extend(p);
  if (o.crushed == RigOptions::Crushed::always ||
      (o.crushed == RigOptions::Crushed::where_no_other && report.examples.empty()))
    for (const auto& [name, field] : crushed_sides(box, o.crush_depth)) {
      stage(0.95, "pose " + name);
      if (auto added = done(author.add_field(name, field)); !added) return std::unexpected(added.error());
    }

  stage(0.97, "convex parts");
  const int slabs = o.convex_parts > 0 ? o.convex_parts : default_slabs(box.sizes());
  set.convex_parts = hull_parts_along_longest_axis(set.mesh.X, surface, slabs, report.enclosing.cell_size / 2);
  if (auto valid = sim::example_based::validate(set, "asset"); !valid) return std::unexpected(valid.error());
  stage(1, "done");
  return out;
}

}  // namespace crumple::authoring
