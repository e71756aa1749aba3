#include "server/authoring/rig_pipeline.h"

#include "common/text.h"
#include "server/authoring/boundary_fit.h"
#include "server/authoring/convex_parts.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/painted_regions.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/rig.h"
#include "server/authoring/surface_transfer.h"
#include "server/sim/mesh/embedding.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::BoneTransform;
using sim::example_based::Example;
using sim::example_based::ExampleSet;
using NamedHandle = sim::example_based::Handle;
using sim::example_based::kMaxBones;
using sim::example_based::kMaxExamples;

std::vector<Vec3> points(const std::vector<NamedHandle>& handles) {
  std::vector<Vec3> out;
  for (const NamedHandle& handle : handles) out.push_back(handle.position);
  return out;
}

bool has_example(const ExampleSet& set, const std::string& name) {
  return std::ranges::any_of(set.examples, [&](const Example& e) { return e.name == name; });
}

Result<void> room_for(const ExampleSet& set, const std::string& name, const std::string& field) {
  if (name.empty()) return invalid(field, "has no name, must have one");
  if (set.example_count() >= kMaxExamples)
    return invalid(
        field, text("\"", name, "\" is one example too many, must be at most ", kMaxExamples, " with the rest pose"));
  if (has_example(set, name)) return invalid(field, "\"" + name + "\" is the name of two examples, must be of one");
  return {};
}

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
  if (o.painted_weights && mesh.weights.rows() != static_cast<Eigen::Index>(V))
    return invalid("painted_weights", "is asked for, but the mesh has no joint weights");
  if (o.painted_weights && (o.automatic_handles > 0 || !o.handles.empty()))
    return invalid("painted_weights", "is asked for beside handles that the mesh has not; they would have no weights");
  for (const DeformedCopy& copy : mesh.copies)
    if (copy.vertices.size() != V)
      return invalid("copies", text("\"", copy.name, "\" has ", copy.vertices.size(), " vertices, must have ", V,
                                    ", those of the surface"));
  return {};
}

// Of the mesh, of the options, and automatic ones; report counts them.
Result<std::vector<NamedHandle>> all_handles(const ArtistMesh& mesh, const RigOptions& o, const sim::TetMesh& tets,
                                             const std::vector<int>& surface, const RigMethods& methods,
                                             RigReport& report) {
  std::vector<NamedHandle> handles = mesh.handles;
  handles.insert(handles.end(), o.handles.begin(), o.handles.end());
  for (std::size_t a = 0; a < handles.size(); ++a) {
    if (!handles[a].position.allFinite()) return invalid(text("handles[", a, "].position"), "is not finite");
    for (std::size_t b = 0; b < a; ++b)
      if (handles[a].name == handles[b].name)
        return invalid("handles", "\"" + handles[a].name + "\" is the name of two handles, must be of one");
  }
  report.given_handles = static_cast<int>(handles.size());
  const int wanted = o.automatic_handles >= 0 ? o.automatic_handles : handles.empty() ? kDefaultHandles : 0;
  const std::vector<Vec3> given = points(handles);
  for (const Vec3& p : methods.place(tets, surface, given, wanted)) {
    std::string name = text("auto ", ++report.automatic_handles);
    while (std::ranges::any_of(handles, [&](const NamedHandle& h) { return h.name == name; })) name += "'";
    handles.push_back({name, p});
  }
  if (report.automatic_handles < wanted)
    report.warnings.push_back(text("only ", report.automatic_handles, " of ", wanted,
                                   " automatic handles are there: the tets have no more places on their surface"));
  if (handles.empty()) return invalid("automatic_handles", "is 0 and no handle is given, must be at least 1");
  if (handles.size() > static_cast<std::size_t>(kMaxBones))
    return invalid("handles", text("are ", handles.size(), " with automatic ones, must be at most ", kMaxBones));
  return handles;
}

// Handles that lie off the surface by more than a fifth of its size act on nothing in particular.
void warn_of_far_handles(const sim::SurfaceMesh& surface, const std::vector<NamedHandle>& handles, RigReport& report) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices) box.extend(p);
  for (const NamedHandle& h : handles)
    if (box.exteriorDistance(h.position) > 0.2 * box.diagonal().norm())
      report.warnings.push_back(
          text("handle \"", h.name, "\" is ", box.exteriorDistance(h.position), " m outside of the surface's box"));
}

Result<Eigen::MatrixXd> weights_of(const ArtistMesh& mesh, const RigOptions& o, const ExampleSet& set,
                                   const SurfaceTransfer& to_nodes, const RigMethods& methods, RigReport& report) {
  auto W = methods.weights(set.mesh, points(set.handles));
  if (!W || !o.painted_weights) return W;
  const Eigen::MatrixXd painted = to_nodes(mesh.weights.transpose());
  int bare = 0;
  for (Eigen::Index i = 0; i < W->rows(); ++i) {
    const double sum = painted.col(i).sum();
    bare += sum < 1e-3;
    if (sum >= 1e-3) W->row(i) = painted.col(i).transpose() / sum;
  }
  if (bare > 0)
    report.warnings.push_back(
        text(bare, " of ", W->rows(), " nodes lie at parts without joint weights; theirs are computed"));
  return W;
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

// A pose of the first handles; the automatic ones follow.
Example completed(const ExampleSet& set, const Example& given, const RigMethods& methods) {
  PartialPose partial(set.handles.size());
  for (std::size_t b = 0; b < given.bones.size(); ++b) partial[b] = given.bones[b];
  return {given.name, methods.complete(set, points(set.handles), partial)};
}

Result<Example> named_pose(const ExampleSet& set, const NamedPose& pose, const RigMethods& methods) {
  if (pose.moves.empty()) return invalid("poses[\"" + pose.name + "\"].moves", "is empty, must name a handle");
  PartialPose partial(set.handles.size());
  for (std::size_t m = 0; m < pose.moves.size(); ++m) {
    const HandleMove& move = pose.moves[m];
    const std::string field = text("poses[\"", pose.name, "\"].moves[", m, "]");
    const auto at = std::ranges::find(set.handles, move.handle, &NamedHandle::name);
    if (at == set.handles.end())
      return invalid(field + ".handle", "is \"" + move.handle + "\", which is no handle of the asset");
    const Vec3 place = move.position.value_or(at->position);
    if (!place.allFinite() || place.cwiseAbs().maxCoeff() > 1e6)
      return invalid(field + ".position", "must be finite and within 1e6 m");
    if (!(move.rotation.norm() > 1e-6) || !move.rotation.coeffs().allFinite())
      return invalid(field + ".rotation", "must be a quaternion of some length");
    const Quat q = move.rotation.normalized();
    auto& bone = partial[static_cast<std::size_t>(at - set.handles.begin())];
    if (bone) return invalid(field + ".handle", "is \"" + move.handle + "\", which is moved twice");
    bone = BoneTransform{q, place - q * at->position};
  }
  return Example{pose.name, methods.complete(set, points(set.handles), partial)};
}

}  // namespace

Result<void> add_pose(ExampleSet& set, const NamedPose& pose, const RigMethods& methods) {
  if (set.handles.empty()) return invalid("handles", "are not in the asset, must be: it was not made by crumple-rig");
  if (auto room = room_for(set, pose.name, "poses"); !room) return room;
  auto example = named_pose(set, pose, methods);
  if (!example) return std::unexpected(example.error());
  set.examples.push_back(*std::move(example));
  return {};
}

Result<void> add_held_pose(ExampleSet& set, const NamedPose& pose) {
  RigMethods methods = default_rig_methods();
  methods.complete = [](const ExampleSet&, std::span<const Vec3>, const PartialPose& partial) {
    std::vector<BoneTransform> bones;
    for (const auto& bone : partial) bones.push_back(bone.value_or(BoneTransform{}));
    return bones;
  };
  return add_pose(set, pose, methods);
}

Result<ExampleReport> add_copy(ExampleSet& set, const DeformedCopy& copy, const RigMethods& methods) {
  if (set.handles.empty()) return invalid("handles", "are not in the asset, must be: it was not made by crumple-rig");
  if (set.render.triangles.empty()) return invalid("render", "is not in the asset, must be: copies deform it");
  const std::size_t V = set.render.vertices.size();
  if (copy.vertices.size() != V)
    return invalid("copies", text("\"", copy.name, "\" has ", copy.vertices.size(), " vertices, must have ", V,
                                  ", those of the surface"));
  if (auto room = room_for(set, copy.name, "copies"); !room) return std::unexpected(room.error());

  Eigen::MatrixXd moves(3, static_cast<Eigen::Index>(V));
  for (std::size_t i = 0; i < V; ++i)
    moves.col(static_cast<Eigen::Index>(i)) = copy.vertices[i] - set.render.vertices[i];
  if (!moves.allFinite()) return invalid("copies", "\"" + copy.name + "\" has a vertex that is not finite");
  const SurfaceDistance distance(set.render);
  const auto field = [&](const Vec3& X) -> Vec3 {
    const auto nearest = distance.nearest(X);
    const Triangle& t = set.render.triangles[static_cast<std::size_t>(nearest.triangle)];
    const auto& u = set.render.vertices;
    const Vec3 share = barycentric(nearest.point, {u[t[0]], u[t[1]], u[t[2]]});
    return share[0] * moves.col(t[0]) + share[1] * moves.col(t[1]) + share[2] * moves.col(t[2]);
  };
  set.examples.push_back(methods.fit(copy.name, set, points(set.handles), field));

  ExampleReport report{.name = copy.name, .source = ExampleReport::Source::copy};
  const std::vector<Vec3> x = skinned(set, set.examples.back().bones);
  std::vector<Vec3> drawn(V);
  sim::embedded_positions(sim::embed(set.render.vertices, set.mesh), set.mesh.tets, x, drawn);
  for (std::size_t i = 0; i < V; ++i) {
    const double away = (drawn[i] - copy.vertices[i]).norm();
    report.residual_rms += away * away / static_cast<double>(V);
    report.residual_largest = std::max(report.residual_largest, away);
  }
  report.residual_rms = std::sqrt(report.residual_rms);
  return report;
}

Result<RiggedAsset> make_asset(const ArtistMesh& mesh, const RigOptions& o, const RigProgress& progress,
                               const RigMethods& methods) {
  using Source = ExampleReport::Source;
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
  auto handles = all_handles(mesh, o, set.mesh, surface, methods, report);
  if (!handles) return std::unexpected(handles.error());
  set.handles = *std::move(handles);
  warn_of_far_handles(mesh.surface, set.handles, report);

  stage(0.5, "weights");
  const SurfaceTransfer to_nodes(mesh.surface, set.mesh.X);
  auto W = weights_of(mesh, o, set, to_nodes, methods, report);
  if (!W) return std::unexpected(W.error());
  set.W = *std::move(W);
  if (o.painted_regions) paint_regions(mesh.colours, to_nodes, set, report);

  set.examples = {rest_example(set.bone_count())};
  for (const Example& pose : mesh.poses) {
    stage(0.7, "pose " + pose.name);
    if (auto room = room_for(set, pose.name, "animations"); !room) return std::unexpected(room.error());
    set.examples.push_back(completed(set, pose, methods));
    report.examples.push_back({.name = pose.name, .source = Source::animation});
  }
  for (std::size_t c = 0; c < mesh.copies.size(); ++c) {
    stage(0.75 + 0.2 * static_cast<double>(c) / static_cast<double>(mesh.copies.size()),
          "fitting " + mesh.copies[c].name);
    auto fitted = add_copy(set, mesh.copies[c], methods);
    if (!fitted) return std::unexpected(fitted.error());
    report.examples.push_back(*std::move(fitted));
  }
  for (const NamedPose& pose : o.poses) {
    stage(0.95, "pose " + pose.name);
    if (auto added = add_pose(set, pose, methods); !added) return std::unexpected(added.error());
    report.examples.push_back({.name = pose.name, .source = Source::handles});
  }
  Eigen::AlignedBox3d box;
  for (const Vec3& p : set.mesh.X) box.extend(p);
  if (o.crushed == RigOptions::Crushed::always ||
      (o.crushed == RigOptions::Crushed::where_no_other && report.examples.empty()))
    for (const auto& [name, field] : crushed_sides(box, o.crush_depth)) {
      stage(0.95, "pose " + name);
      if (auto room = room_for(set, name, "crushed"); !room) return std::unexpected(room.error());
      set.examples.push_back(fit_example(name, set.W, set.mesh.X, points(set.handles), field));
      report.examples.push_back({.name = name, .source = Source::crushed});
    }

  stage(0.97, "convex parts");
  const int slabs = o.convex_parts > 0 ? o.convex_parts : default_slabs(box.sizes());
  set.convex_parts = hull_parts_along_longest_axis(set.mesh.X, surface, slabs, report.enclosing.cell_size / 2);
  if (auto valid = sim::example_based::validate(set, "asset"); !valid) return std::unexpected(valid.error());
  stage(1, "done");
  return out;
}

}  // namespace crumple::authoring
