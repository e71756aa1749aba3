#pragma once

#include "server/io/gltf_document.h"

namespace crumple::io {

// A node's own transform.
struct GltfTransform {
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();  // where `given_as_matrix`
  Vec3 translation = Vec3::Zero();
  Quat rotation = Quat::Identity();
  Vec3 scale = Vec3::Ones();
  bool given_as_matrix = false;
  Eigen::Affine3d value() const;
};

// One a node. Errors: a matrix, translation, rotation or scale that is not as many finite numbers as it takes.
Result<std::vector<GltfTransform>> local_transforms(const GltfDocument& document);
std::vector<int> node_parents(const GltfDocument& document);  // -1: none
// The product of transforms from the root on.
std::vector<Eigen::Affine3d> world_transforms(const std::vector<GltfTransform>& local, const std::vector<int>& parents);

// Nodes of the scene (the file's default one, else its first, else all), parents before children.
Result<std::vector<int>> scene_nodes(const GltfDocument& document);

}  // namespace crumple::io
