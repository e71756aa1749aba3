#include "server/io/gltf_primitive.h"

#include "common/text.h"

#include <span>

namespace crumple::io {
namespace {

constexpr std::size_t kMaxPlacedVertices = 5'000'000;  // a small file can name its meshes without end
constexpr std::size_t kMaxCopies = 1000;

// A primitive's vertex attributes, one item a vertex.
class Primitive {
 public:
  Primitive(const GltfDocument& document, const Json& mesh, const Json& primitive, std::string where)
      : document_(document), mesh_(mesh), primitive_(primitive), where_(std::move(where)) {}

  // Adds its vertices, placed, and its triangles.
  Result<void> add_to(GltfVertices& raw, const Eigen::Affine3d& placement, const std::vector<int>* handle_of_joint) {
    const int mode = primitive_.is_object() && primitive_.contains("mode") && primitive_["mode"].is_number_integer()
                         ? primitive_["mode"].get<int>()
                         : 4;
    if (mode < 4 || mode > 6) return {};  // points and lines
    const Json& attributes = GltfDocument::object_of(primitive_, "attributes");
    const auto positions = document_.accessor(attributes, "POSITION", {3}, where_ + ".attributes");
    if (!positions) return std::unexpected(positions.error());
    const std::size_t first = raw.vertices.size();
    const auto count = static_cast<std::size_t>(positions->cols());
    if (first + count > kMaxPlacedVertices)
      return document_.fault(text("places more than ", kMaxPlacedVertices, " vertices"));
    raw.vertices.resize(first + count);
    std::span<GltfVertex> own(raw.vertices.data() + first, count);
    for (std::size_t i = 0; i < count; ++i)
      own[i].position = placement * Vec3(positions->col(static_cast<Eigen::Index>(i)));
    if (auto r = read_colours(attributes, own, raw); !r) return r;
    if (handle_of_joint)
      if (auto r = read_weights(attributes, own, *handle_of_joint); !r) return r;
    if (auto r = read_targets(own, raw, placement.linear()); !r) return r;
    return add_triangles(raw, static_cast<int>(first), static_cast<int>(count), mode,
                         placement.linear().determinant() < 0);
  }

 private:
  Result<void> same_count(const Eigen::MatrixXd& items, std::size_t vertices, const std::string& name) const {
    if (static_cast<std::size_t>(items.cols()) == vertices) return {};
    return document_.fault(
        text(where_, " has ", items.cols(), " items of ", name, ", must have ", vertices, ", one a vertex"));
  }

  Result<void> read_colours(const Json& attributes, std::span<GltfVertex> own, GltfVertices& raw) const {
    if (!attributes.contains("COLOR_0")) return {};
    const auto colours = document_.accessor(attributes, "COLOR_0", {3, 4}, where_ + ".attributes");
    if (!colours) return std::unexpected(colours.error());
    if (auto same = same_count(*colours, own.size(), "COLOR_0"); !same) return same;
    for (std::size_t i = 0; i < own.size(); ++i)
      own[i].colour = colours->col(static_cast<Eigen::Index>(i)).head<3>().cwiseMax(0).cwiseMin(1);
    raw.coloured = true;
    return {};
  }

  Result<void> read_weights(const Json& attributes, std::span<GltfVertex> own,
                            const std::vector<int>& handle_of_joint) const {
    for (int set = 0; attributes.contains(text("JOINTS_", set)); ++set) {
      const std::string joints_key = text("JOINTS_", set), weights_key = text("WEIGHTS_", set);
      const auto joints = document_.accessor(attributes, joints_key.c_str(), {4}, where_ + ".attributes");
      if (!joints) return std::unexpected(joints.error());
      const auto weights = document_.accessor(attributes, weights_key.c_str(), {4}, where_ + ".attributes");
      if (!weights) return std::unexpected(weights.error());
      if (auto same = same_count(*joints, own.size(), joints_key); !same) return same;
      if (auto same = same_count(*weights, own.size(), weights_key); !same) return same;
      for (std::size_t i = 0; i < own.size(); ++i)
        for (int k = 0; k < 4; ++k) {
          const double weight = (*weights)(k, static_cast<Eigen::Index>(i)),
                       joint = (*joints)(k, static_cast<Eigen::Index>(i));
          if (weight == 0) continue;
          if (weight < 0)
            return document_.fault(
                text(where_, ".attributes.", weights_key, " is ", weight, " at vertex ", i, ", must not be negative"));
          if (joint < 0 || joint >= static_cast<double>(handle_of_joint.size()))
            return document_.fault(text(where_, ".attributes.", joints_key, " is ", joint, " at vertex ", i,
                                        ", must be below ", handle_of_joint.size(), ", the skin's joints"));
          own[i].weights.emplace_back(handle_of_joint[static_cast<std::size_t>(joint)], weight);
        }
    }
    return {};
  }

  Result<void> read_targets(std::span<GltfVertex> own, GltfVertices& raw, const Mat3& linear) const {
    const Json& targets = GltfDocument::list_of(primitive_, "targets");
    for (std::size_t k = 0; k < targets.size(); ++k) {
      if (!GltfDocument::has(targets[k], "POSITION")) continue;
      const std::string where = text(where_, ".targets[", k, "]");
      const auto deltas = document_.accessor(targets[k], "POSITION", {3}, where);
      if (!deltas) return std::unexpected(deltas.error());
      if (auto same = same_count(*deltas, own.size(), text("targets[", k, "].POSITION")); !same) return same;
      const int copy = raw.copy(target_name(mesh_, k));
      if (raw.copies.size() > kMaxCopies) return document_.fault(text("has more than ", kMaxCopies, " morph targets"));
      for (std::size_t i = 0; i < own.size(); ++i)
        if (const Vec3 delta = deltas->col(static_cast<Eigen::Index>(i)); delta != Vec3::Zero())
          own[i].moves.emplace_back(copy, linear * delta);
    }
    return {};
  }

  Result<void> add_triangles(GltfVertices& raw, int first, int count, int mode, bool mirrored) const {
    std::vector<int> ids;
    if (primitive_.contains("indices")) {
      const auto indices = document_.accessor(primitive_, "indices", {1}, where_);
      if (!indices) return std::unexpected(indices.error());
      for (Eigen::Index k = 0; k < indices->cols(); ++k) {
        if ((*indices)(0, k) < 0 || (*indices)(0, k) >= count)
          return document_.fault(
              text(where_, ".indices[", k, "] is ", (*indices)(0, k), ", must be below ", count, ", its vertices"));
        ids.push_back(first + static_cast<int>((*indices)(0, k)));
      }
    } else {
      for (int i = 0; i < count; ++i) ids.push_back(first + i);
    }
    const auto add = [&](int a, int b, int c) {
      if (mirrored) std::swap(b, c);
      raw.triangles.push_back({a, b, c});
    };
    if (mode == 4)
      for (std::size_t k = 0; k + 2 < ids.size(); k += 3) add(ids[k], ids[k + 1], ids[k + 2]);
    for (std::size_t k = 0; mode == 5 && k + 2 < ids.size(); ++k) add(ids[k], ids[k + 1 + k % 2], ids[k + 2 - k % 2]);
    for (std::size_t k = 1; mode == 6 && k + 1 < ids.size(); ++k) add(ids[k], ids[k + 1], ids[0]);
    return {};
  }

  const GltfDocument& document_;
  const Json& mesh_;
  const Json& primitive_;
  std::string where_;
};

}  // namespace

std::string target_name(const Json& mesh, std::size_t k) {
  const Json& names = GltfDocument::list_of(GltfDocument::object_of(mesh, "extras"), "targetNames");
  if (k < names.size() && names[k].is_string() && !names[k].get_ref<const std::string&>().empty())
    return names[k].get<std::string>();
  return text("morph ", k);
}

Result<void> add_primitive(const GltfDocument& document, const Json& mesh, const Json& primitive, std::string where,
                           const Eigen::Affine3d& placement, const std::vector<int>* handle_of_joint,
                           GltfVertices& vertices) {
  return Primitive(document, mesh, primitive, std::move(where)).add_to(vertices, placement, handle_of_joint);
}

}  // namespace crumple::io
