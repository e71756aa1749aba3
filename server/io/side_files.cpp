#include "server/io/side_files.h"

#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"

#include <algorithm>

namespace crumple::io {

namespace fs = std::filesystem;

bool is_inside_name(std::string_view name) {
  const fs::path path(name);
  return !name.empty() && name.find('\0') == std::string_view::npos && !path.has_root_path() &&
         std::ranges::find(path, fs::path("..")) == path.end();
}

bool lies_inside(const fs::path& file, const fs::path& folder) {
  std::error_code failure;
  const fs::path root = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, failure);
  if (failure) return false;
  // Made absolute first: of a file that is not there yet, a relative path would stay one.
  const fs::path real = fs::weakly_canonical(fs::absolute(file, failure), failure);
  return !failure && std::mismatch(root.begin(), root.end(), real.begin(), real.end()).first == root.end();
}

SideFiles::SideFiles(fs::path mesh_file, std::string& outside)
    : mesh_file_(std::move(mesh_file)), folder_(mesh_file_.parent_path()), outside_(outside) {}

bool SideFiles::allowed(const fs::path& file) const {
  if (file == mesh_file_) return true;
  if (!lies_inside(file, folder_)) {
    if (outside_.empty()) outside_ = file.lexically_proximate(folder_).string();
    return false;
  }
  // Materials are not looked at; of an OBJ nothing else is needed.
  return has_ending(mesh_file_, {".gltf", ".glb"}) && check_file(file, kMaxMeshFileBytes).has_value();
}

bool SideFiles::Exists(const char* name) const { return allowed(name) && DefaultIOSystem::Exists(name); }

Assimp::IOStream* SideFiles::Open(const char* name, const char* mode) {
  return allowed(name) ? DefaultIOSystem::Open(name, mode) : nullptr;
}

}  // namespace crumple::io
