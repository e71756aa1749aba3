#include "server/io/gltf_nodes.h"

#include "common/text.h"

#include <cmath>

namespace crumple::io {
namespace {

// `n` numbers; false where there is something else.
bool numbers(const Json& list, std::size_t n, double* out) {
  if (!list.is_array() || list.size() != n) return false;
  for (std::size_t k = 0; k < n; ++k) {
    if (!list[k].is_number()) return false;
    out[k] = list[k].get<double>();
    if (!std::isfinite(out[k])) return false;
  }
  return true;
}

}  // namespace

Eigen::Affine3d GltfTransform::value() const {
  if (given_as_matrix) return matrix;
  return Eigen::Translation3d(translation) * rotation * Eigen::Scaling(scale);
}

Result<std::vector<GltfTransform>> local_transforms(const GltfDocument& document) {
  const Json& nodes = document.list("nodes");
  std::vector<GltfTransform> out(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto wrong = [&](const char* key, const char* rule) {
      return document.fault(text("nodes[", i, "].", key, " must be ", rule));
    };
    double m[16];
    if (GltfDocument::has(nodes[i], "matrix")) {
      if (!numbers(nodes[i]["matrix"], 16, m)) return wrong("matrix", "16 numbers");
      out[i].matrix.matrix() = Eigen::Map<const Eigen::Matrix4d>(m);  // both column-major
      out[i].matrix.makeAffine();
      out[i].given_as_matrix = true;
    }
    if (GltfDocument::has(nodes[i], "translation") && !numbers(nodes[i]["translation"], 3, out[i].translation.data()))
      return wrong("translation", "3 numbers");
    if (GltfDocument::has(nodes[i], "scale") && !numbers(nodes[i]["scale"], 3, out[i].scale.data()))
      return wrong("scale", "3 numbers");
    if (GltfDocument::has(nodes[i], "rotation")) {
      if (!numbers(nodes[i]["rotation"], 4, m) || !(Eigen::Map<const Eigen::Vector4d>(m).norm() > 1e-6))
        return wrong("rotation", "a quaternion of 4 numbers that are not all 0");
      out[i].rotation = Quat(m[3], m[0], m[1], m[2]).normalized();
    }
  }
  return out;
}

std::vector<int> node_parents(const GltfDocument& document) {
  const Json& nodes = document.list("nodes");
  std::vector<int> parent(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const Json& child : GltfDocument::list_of(nodes[i], "children"))
      parent[child.get<std::size_t>()] = static_cast<int>(i);  // check_gltf saw to the range
  return parent;
}

std::vector<Eigen::Affine3d> world_transforms(const std::vector<GltfTransform>& local,
                                              const std::vector<int>& parents) {
  std::vector<Eigen::Affine3d> world(local.size());
  for (std::size_t i = 0; i < local.size(); ++i) {
    world[i] = local[i].value();
    for (int p = parents[i]; p >= 0; p = parents[p]) world[i] = local[p].value() * world[i];
  }
  return world;
}

Result<std::vector<int>> scene_nodes(const GltfDocument& document) {
  const Json& nodes = document.list("nodes");
  const Json& scenes = document.list("scenes");
  std::vector<int> stack, out;
  if (scenes.empty()) {
    const std::vector<int> parent = node_parents(document);
    for (std::size_t i = nodes.size(); i-- > 0;)
      if (parent[i] < 0) stack.push_back(static_cast<int>(i));
  } else {
    std::size_t chosen = 0;
    if (GltfDocument::has(document.root(), "scene")) {
      const auto given = document.index(document.root(), "scene", scenes.size(), "document");
      if (!given) return std::unexpected(given.error());
      chosen = static_cast<std::size_t>(*given);
    }
    const Json& roots = GltfDocument::list_of(scenes[chosen], "nodes");
    std::vector<char> seen(nodes.size(), false);
    for (std::size_t k = roots.size(); k-- > 0;) {
      const std::int64_t root = roots[k].is_number_unsigned() ? roots[k].get<std::int64_t>() : -1;
      if (root < 0 || root >= static_cast<std::int64_t>(nodes.size()) || seen[root])
        return document.fault(text("scenes[", chosen, "].nodes[", k, "] names no node, or one twice"));
      seen[root] = true;
      stack.push_back(static_cast<int>(root));
    }
  }
  while (!stack.empty()) {
    const int node = stack.back();
    stack.pop_back();
    out.push_back(node);
    if (out.size() > nodes.size()) return document.fault("has scenes that name a node below another one");
    const Json& children = GltfDocument::list_of(nodes[static_cast<std::size_t>(node)], "children");
    for (std::size_t k = children.size(); k-- > 0;) stack.push_back(children[k].get<int>());
  }
  return out;
}

}  // namespace crumple::io
