#pragma once

#include <assimp/DefaultIOSystem.h>

#include <filesystem>
#include <string>
#include <string_view>

// What a mesh file names beside itself: buffers of a .gltf, the .mtl of an OBJ, the .ele of a .node. It lies in the
// mesh file's folder or below it.
namespace crumple::io {

// A relative path without "..", as a name in a file has to be. Says nothing about links.
bool is_inside_name(std::string_view name);

// Whether the file, with links resolved, lies in the folder or below it. Neither has to exist.
bool lies_inside(const std::filesystem::path& file, const std::filesystem::path& folder);

// The files that Assimp may open: the mesh file, and for glTF those that check_file accepts in its folder or below.
// `outside` gets the first name that leads out of it.
class SideFiles final : public Assimp::DefaultIOSystem {
 public:
  SideFiles(std::filesystem::path mesh_file, std::string& outside);

  bool Exists(const char* name) const override;
  Assimp::IOStream* Open(const char* name, const char* mode) override;

 private:
  bool allowed(const std::filesystem::path& file) const;

  std::filesystem::path mesh_file_, folder_;
  std::string& outside_;
};

}  // namespace crumple::io
