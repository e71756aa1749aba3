#pragma once

#include "server/scene_convert/mesh_source.h"

#include <filesystem>

namespace crumple::io {

// Meshes and assets in a folder and below it. A name is a relative path in the folder: absolute paths, `..`, and links
// that lead out are errors, whether or not such a file exists.
// By extension: surfaces .obj .gltf .glb .ply .stl .off .fbx; tets .node .ele .msh .veg; both, and example sets, also from
// asset files (.crumple-asset, .json).
class SceneFolder final : public scene_convert::MeshSource {
 public:
  explicit SceneFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  Result<sim::SurfaceMesh> surface(const std::string& name) const override;
  Result<sim::TetMesh> tets(const std::string& name) const override;
  Result<sim::example_based::ExampleSet> examples(const std::string& name) const override;

  // The file that a name means, with links resolved.
  Result<std::filesystem::path> resolve(const std::string& name) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace crumple::io
