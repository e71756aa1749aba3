#pragma once

#include "server/io/gltf_document.h"

#include <algorithm>

namespace crumple::io {

// As the file has it, where the scene places it.
struct GltfVertex {
  Vec3 position, colour = Vec3::Ones();
  std::vector<std::pair<int, double>> weights;  // handle, and its share
  std::vector<std::pair<int, Vec3>> moves;      // copy, and its displacement [m]
};

// Of all that the scene places.
struct GltfVertices {
  std::vector<GltfVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::string> copies;
  bool coloured = false;

  // The id of a copy, which is added where it is new.
  int copy(const std::string& name) {
    const auto at = std::find(copies.begin(), copies.end(), name);
    if (at != copies.end()) return static_cast<int>(at - copies.begin());
    copies.push_back(name);
    return static_cast<int>(copies.size()) - 1;
  }
};

// The name of a mesh's morph target k.
std::string target_name(const Json& mesh, std::size_t k);

// Adds a primitive's vertices, placed, and its triangles. mesh: that it is of. where: its path. handle_of_joint: of the
// skin's joints; null: none. Errors: attributes of other numbers than the vertices, joints, weights and indices that
// are out of range, above 5,000,000 vertices or 1,000 morph targets.
Result<void> add_primitive(const GltfDocument& document, const Json& mesh, const Json& primitive, std::string where,
                           const Eigen::Affine3d& placement, const std::vector<int>* handle_of_joint,
                           GltfVertices& vertices);

}  // namespace crumple::io
