#include "server/folder_scenes.h"

#include "server/io/scene_file.h"

#include <algorithm>

namespace crumple {
namespace {

bool is_plain(const std::string& name) {
  const auto allowed = [](unsigned char c) { return c > ' ' && c != '/' && c != '\\' && c != ':' && c != 0x7f; };
  return !name.empty() && name.size() <= 255 && name.front() != '.' && std::ranges::all_of(name, allowed);
}

}  // namespace

std::vector<std::string> FolderScenes::names() const { return io::scene_names(folder_); }

Result<sim::SceneDescription> FolderScenes::load(const std::string& name) const {
  if (!is_plain(name))
    return invalid("scene_file", "is \"" + name.substr(0, 255) + "\", must be the plain name of a file in the scene folder");
  const std::filesystem::path file = folder_ / (name.ends_with(".json") ? name : name + ".json");
  std::error_code ignored;
  // A link may lead out of the folder.
  const auto real = std::filesystem::weakly_canonical(file, ignored);
  const auto root = std::filesystem::weakly_canonical(folder_, ignored);
  if (!std::filesystem::is_regular_file(real, ignored) || real.parent_path() != root)
    return std::unexpected(Error{ErrorCode::not_found, "scene_file", "is \"" + name + "\", there is no such scene"});
  auto loaded = io::load_scene(file);
  if (!loaded) return std::unexpected(loaded.error());
  return std::move(loaded->scene);
}

}  // namespace crumple
