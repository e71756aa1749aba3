#include "server/scene_convert/asset_convert.h"

#include "server/scene_convert/geometry_convert.h"
#include "server/scene_convert/skin_weights_convert.h"
#include "server/sim/limits.h"

#include <google/protobuf/repeated_field.h>

#include <array>
#include <string_view>
#include <utility>

namespace crumple::scene_convert {
namespace {

using google::protobuf::RepeatedField;
using sim::example_based::BoneTransform;
using sim::example_based::ExampleSet;

Result<void> whole(int size, int stride, const std::string& field, const char* entity) {
  if (size % stride == 0) return {};
  return invalid(field,
                 "has " + std::to_string(size) + " numbers, must have " + std::to_string(stride) + " a " + entity);
}

std::vector<Vec3> to_points(const RepeatedField<double>& flat) {
  std::vector<Vec3> points(static_cast<std::size_t>(flat.size() / 3));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Map<const Vec3>(flat.data() + 3 * i);
  return points;
}

template <std::size_t n>
std::vector<std::array<int, n>> to_ids(const RepeatedField<std::int32_t>& flat) {
  std::vector<std::array<int, n>> ids(static_cast<std::size_t>(flat.size()) / n);
  for (std::size_t i = 0; i < ids.size(); ++i)
    for (std::size_t k = 0; k < n; ++k) ids[i][k] = flat.Get(static_cast<int>(n * i + k));
  return ids;
}

void add_points(RepeatedField<double>* flat, const std::vector<Vec3>& points) {
  flat->Reserve(static_cast<int>(3 * points.size()));
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) flat->Add(p[k]);
}

template <std::size_t n>
void add_ids(RepeatedField<std::int32_t>* flat, const std::vector<std::array<int, n>>& ids) {
  flat->Reserve(static_cast<int>(n * ids.size()));
  for (const auto& tuple : ids)
    for (const int id : tuple) flat->Add(id);
}

Result<BoneTransform> to_bone(const v1::BoneTransform& message, const std::string& field) {
  BoneTransform bone;
  if (message.has_rotation()) {
    const Result<Quat> q = to_rotation(message.rotation(), field + ".rotation");
    if (!q) return std::unexpected(q.error());
    bone.q = Quat(message.rotation().w(), message.rotation().x(), message.rotation().y(), message.rotation().z());
  }
  bone.t = to_vec3(message.translation());
  sim::FirstBreach breach;
  breach.vector(bone.t, sim::kMaxPosition, field + ".translation");
  if (!breach.ok()) return std::unexpected(breach.result().error());
  return bone;
}

Result<sim::example_based::Example> to_example(const v1::Example& message, const std::string& field) {
  sim::example_based::Example example{message.name(), {}};
  if (message.name().size() > sim::limits::kMaxNameBytes)
    return invalid(field + ".name", "has " + std::to_string(message.name().size()) + " bytes, must have at most 256");
  for (int b = 0; b < message.bones_size(); ++b) {
    const Result<BoneTransform> bone = to_bone(message.bones(b), field + ".bones[" + std::to_string(b) + "]");
    if (!bone) return std::unexpected(bone.error());
    example.bones.push_back(*bone);
  }
  return example;
}

Result<std::vector<sim::example_based::Handle>> to_handles(
    const google::protobuf::RepeatedPtrField<v1::Handle>& messages, const std::string& field) {
  std::vector<sim::example_based::Handle> handles;
  for (const v1::Handle& message : messages) {
    const std::string at = field + "[" + std::to_string(handles.size()) + "]";
    if (message.name().size() > sim::limits::kMaxNameBytes)
      return invalid(at + ".name", "has " + std::to_string(message.name().size()) + " bytes, must have at most 256");
    sim::FirstBreach breach;
    const Vec3 position = to_vec3(message.position());
    breach.vector(position, sim::kMaxPosition, at + ".position");
    if (!breach.ok()) return std::unexpected(breach.result().error());
    handles.push_back({message.name(), position});
  }
  return handles;
}

// The value's own gate, in the messages' names.
template <class T>
Result<T> checked(T&& value, const std::string& field) {
  if (const Result<void> valid = validate(value, field); !valid)
    return std::unexpected(in_message_names(valid.error()));
  return std::move(value);
}

}  // namespace

Result<sim::TetMesh> to_tet_mesh(const v1::TetMesh& message, const std::string& field) {
  if (auto r = whole(message.positions_size(), 3, field + ".positions", "node"); !r) return std::unexpected(r.error());
  if (auto r = whole(message.tets_size(), 4, field + ".tets", "tet"); !r) return std::unexpected(r.error());
  if (message.tets_size() / 4 > sim::kMaxTets)  // before anything is allocated
    return invalid(field + ".tets", "holds " + std::to_string(message.tets_size() / 4) + " tets, must hold at most " +
                                        std::to_string(sim::kMaxTets));
  return checked(
      sim::TetMesh{
          to_points(message.positions()), to_ids<4>(message.tets()), {message.fill().begin(), message.fill().end()},
          {message.tags().begin(), message.tags().end()}},
      field);
}

Result<sim::SurfaceMesh> to_surface_mesh(const v1::SurfaceMesh& message, const std::string& field) {
  if (auto r = whole(message.vertices_size(), 3, field + ".vertices", "vertex"); !r) return std::unexpected(r.error());
  if (auto r = whole(message.triangles_size(), 3, field + ".triangles", "triangle"); !r)
    return std::unexpected(r.error());
  return checked(sim::SurfaceMesh{to_points(message.vertices()), to_ids<3>(message.triangles())}, field);
}

Result<ExampleSet> to_example_set(const v1::ExampleSet& message, const std::string& field) {
  ExampleSet set;
  Result<sim::TetMesh> mesh = to_tet_mesh(message.mesh(), field + ".mesh");
  if (!mesh) return std::unexpected(mesh.error());
  set.mesh = *std::move(mesh);
  Result<Eigen::MatrixXd> W = to_weights(message.weights(), set.vertex_count(), field + ".weights");
  if (!W) return std::unexpected(W.error());
  set.W = *std::move(W);
  for (int e = 0; e < message.examples_size(); ++e) {
    auto example = to_example(message.examples(e), field + ".examples[" + std::to_string(e) + "]");
    if (!example) return std::unexpected(example.error());
    set.examples.push_back(*std::move(example));
  }
  for (const v1::ConvexPart& part : message.convex_parts())
    set.convex_parts.emplace_back(part.vertices().begin(), part.vertices().end());
  if (message.has_render()) {
    auto render = to_surface_mesh(message.render(), field + ".render");
    if (!render) return std::unexpected(render.error());
    set.render = *std::move(render);
  }
  auto handles = to_handles(message.handles(), field + ".handles");
  if (!handles) return std::unexpected(handles.error());
  set.handles = *std::move(handles);
  set.alpha_scale.assign(message.alpha_scale().begin(), message.alpha_scale().end());
  set.beta_scale.assign(message.beta_scale().begin(), message.beta_scale().end());
  return checked(std::move(set), field);
}

v1::TetMesh to_message(const sim::TetMesh& mesh) {
  v1::TetMesh message;
  add_points(message.mutable_positions(), mesh.X);
  add_ids<4>(message.mutable_tets(), mesh.tets);
  message.mutable_fill()->Add(mesh.fill.begin(), mesh.fill.end());
  message.mutable_tags()->Add(mesh.tags.begin(), mesh.tags.end());
  return message;
}

v1::SurfaceMesh to_message(const sim::SurfaceMesh& mesh) {
  v1::SurfaceMesh message;
  add_points(message.mutable_vertices(), mesh.vertices);
  add_ids<3>(message.mutable_triangles(), mesh.triangles);
  return message;
}

v1::ExampleSet to_message(const ExampleSet& set) {
  v1::ExampleSet message;
  *message.mutable_mesh() = to_message(set.mesh);
  *message.mutable_weights() = to_message(set.W);
  for (const sim::example_based::Example& example : set.examples) {
    v1::Example* e = message.add_examples();
    e->set_name(example.name);
    for (const BoneTransform& bone : example.bones) {
      v1::BoneTransform* b = e->add_bones();
      *b->mutable_rotation() = to_message(bone.q);
      *b->mutable_translation() = to_message(bone.t);
    }
  }
  for (const std::vector<int>& part : set.convex_parts)
    message.add_convex_parts()->mutable_vertices()->Add(part.begin(), part.end());
  for (const sim::example_based::Handle& handle : set.handles) {
    v1::Handle* h = message.add_handles();
    h->set_name(handle.name);
    *h->mutable_position() = to_message(handle.position);
  }
  if (!set.render.vertices.empty()) *message.mutable_render() = to_message(set.render);
  message.mutable_alpha_scale()->Add(set.alpha_scale.begin(), set.alpha_scale.end());
  message.mutable_beta_scale()->Add(set.beta_scale.begin(), set.beta_scale.end());
  return message;
}

Error in_message_names(Error error) {
  static constexpr std::pair<std::string_view, std::string_view> kNames[] = {
      {"X", "positions"}, {"W", "weights"}, {"q", "rotation"}, {"t", "translation"}};
  std::string path;
  std::string_view last, before;  // the parts of the path before this one
  for (std::size_t begin = 0; begin < error.field.size();) {
    std::size_t end = error.field.find_first_of(".[", begin + 1);
    if (end == std::string::npos) end = error.field.size();
    const bool dotted = error.field[begin] == '.';
    std::string_view name = std::string_view(error.field).substr(begin + dotted, end - begin - dotted);
    for (const auto& [core, message] : kNames)
      if (name == core) name = message;
    if (before == "convex_parts" && name.starts_with('[')) path += ".vertices";
    if (dotted) path += '.';
    path += name;
    before = std::exchange(last, name);
    begin = end;
  }
  error.field = path;
  return error;
}

}  // namespace crumple::scene_convert
