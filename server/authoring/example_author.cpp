#include "server/authoring/example_author.h"

#include "common/text.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/pose_from_shape.h"
#include "server/authoring/tet_laplacian.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::BoneTransform;
using sim::example_based::Example;
using sim::example_based::kMaxExamples;
using NamedHandle = sim::example_based::Handle;

Result<std::vector<HandleTarget>> targets_of(const std::vector<NamedHandle>& handles, const NamedPose& pose,
                                             UnnamedHandles unnamed) {
  if (pose.moves.empty()) return invalid("poses[\"" + pose.name + "\"].moves", "is empty, must name a handle");
  std::vector<HandleTarget> out(handles.size());
  std::vector<bool> named(handles.size(), false);
  for (std::size_t m = 0; m < pose.moves.size(); ++m) {
    const HandleMove& move = pose.moves[m];
    const std::string field = text("poses[\"", pose.name, "\"].moves[", m, "]");
    const auto at = std::ranges::find(handles, move.handle, &NamedHandle::name);
    if (at == handles.end())
      return invalid(field + ".handle", "is \"" + move.handle + "\", which is no handle of the asset");
    const std::size_t b = static_cast<std::size_t>(at - handles.begin());
    if (named[b]) return invalid(field + ".handle", "is \"" + move.handle + "\", which is moved twice");
    named[b] = true;
    out[b] = {move.position.value_or(at->position), move.rotation};
    if (!out[b].position->allFinite() || out[b].position->cwiseAbs().maxCoeff() > 1e6)
      return invalid(field + ".position", "must be finite and within 1e6 m");
    if (move.rotation && (!(move.rotation->norm() > 1e-6) || !move.rotation->coeffs().allFinite()))
      return invalid(field + ".rotation", "must be a quaternion of some length");
  }
  if (unnamed == UnnamedHandles::held)
    for (std::size_t b = 0; b < out.size(); ++b)
      if (!named[b]) out[b] = {handles[b].position, Quat::Identity()};
  return out;
}

}  // namespace

std::vector<Vec3> points_of(const std::vector<NamedHandle>& handles) {
  std::vector<Vec3> out;
  for (const NamedHandle& handle : handles) out.push_back(handle.position);
  return out;
}

Result<void> ExampleAuthor::room_for(const std::string& name, const std::string& field) const {
  if (set_.handles.empty()) return invalid("handles", "are not in the asset, must be: it was not made by crumple-rig");
  if (name.empty()) return invalid(field, "has no name, must have one");
  if (set_.example_count() >= kMaxExamples)
    return invalid(
        field, text("\"", name, "\" is one example too many, must be at most ", kMaxExamples, " with the rest pose"));
  if (std::ranges::any_of(set_.examples, [&](const Example& e) { return e.name == name; }))
    return invalid(field, "\"" + name + "\" is the name of two examples, must be of one");
  return {};
}

Result<ExampleReport> ExampleAuthor::complete(const std::string& name, const std::vector<HandleTarget>& targets) {
  if (!solver_) {
    auto made = PoseSolver::make(set_.mesh, set_.W, points_of(set_.handles));
    if (!made) return std::unexpected(made.error());
    solver_ = *std::move(made);
  }
  auto solved = solver_->solve(targets, "poses[\"" + name + "\"]");
  if (!solved) return std::unexpected(solved.error());
  set_.examples.push_back({name, std::move(solved->bones)});
  return ExampleReport{.name = name,
                       .source = ExampleReport::Source::handles,
                       .strain = solved->report.strain,
                       .converged = solved->report.converged};
}

Result<ExampleReport> ExampleAuthor::add_animation(const Example& joints) {
  if (auto room = room_for(joints.name, "animations"); !room) return std::unexpected(room.error());
  ExampleReport report{.name = joints.name, .source = ExampleReport::Source::animation};
  if (joints.bones.size() == set_.handles.size()) {
    set_.examples.push_back(joints);
    return report;
  }
  std::vector<std::optional<BoneTransform>> pose(set_.handles.size());
  std::ranges::copy(joints.bones, pose.begin());
  auto completed = complete(joints.name, authoring::targets_of(pose, points_of(set_.handles)));
  if (completed) completed->source = ExampleReport::Source::animation;
  return completed;
}

Result<ExampleReport> ExampleAuthor::add_pose(const NamedPose& pose, UnnamedHandles unnamed) {
  if (auto room = room_for(pose.name, "poses"); !room) return std::unexpected(room.error());
  const auto targets = targets_of(set_.handles, pose, unnamed);
  if (!targets) return std::unexpected(targets.error());
  return complete(pose.name, *targets);
}

Result<ExampleReport> ExampleAuthor::add_copy(const DeformedShape& copy) {
  const auto& surface = set_.render;
  if (auto room = room_for(copy.name, "copies"); !room) return std::unexpected(room.error());
  if (surface.triangles.empty()) return invalid("render", "is not in the asset, must be: copies deform it");
  const std::size_t V = surface.vertices.size();
  if (copy.vertices.size() != V)
    return invalid("copies", text("\"", copy.name, "\" has ", copy.vertices.size(), " vertices, must have ", V,
                                  ", those of the surface"));
  if (!std::ranges::all_of(copy.vertices, [](const Vec3& x) { return x.allFinite(); }))
    return invalid("copies", "\"" + copy.name + "\" has a vertex that is not finite");
  if (!drawn_) {
    SurfaceSamples samples(surface, mean_edge_length(set_.mesh));
    const std::vector<Vec3> rest = samples.at(surface.vertices);
    drawn_ = {std::move(samples), rest, EmbeddedSkinning(set_.mesh, set_.W, rest)};
  }
  auto fitted = pose_from_shape(drawn_->skinning, drawn_->rest, {copy.name, drawn_->samples.at(copy.vertices)},
                                "copies", kTurnPenalty);
  if (!fitted) return std::unexpected(fitted.error());
  set_.examples.push_back(std::move(fitted->example));
  const PoseResidual& residual = fitted->residual;
  return ExampleReport{.name = copy.name,
                       .source = ExampleReport::Source::copy,
                       .residual_rms = residual.rms,
                       .residual_largest = residual.max,
                       .residual_relative = residual.relative(),
                       .converged = residual.converged};
}

Result<ExampleReport> ExampleAuthor::add_field(const std::string& name, const PoseField& field) {
  if (auto room = room_for(name, "crushed"); !room) return std::unexpected(room.error());
  set_.examples.push_back(fit_example(name, set_.W, set_.mesh.X, points_of(set_.handles), field));
  ExampleReport report{.name = name, .source = ExampleReport::Source::crushed};
  const std::vector<Vec3> x = skinned(set_, set_.examples.back().bones);
  double missed = 0, moved = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 wanted = field(set_.mesh.X[i]), left = x[i] - set_.mesh.X[i] - wanted;
    missed += left.squaredNorm();
    moved += wanted.squaredNorm();
    report.residual_largest = std::max(report.residual_largest, left.norm());
  }
  report.residual_rms = std::sqrt(missed / static_cast<double>(x.size()));
  report.residual_relative = moved > 0 ? std::sqrt(missed / moved) : 0;
  return report;
}

}  // namespace crumple::authoring
