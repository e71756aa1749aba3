#include "server/io/scene_folder.h"

#include "server/io/asset_file.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"
#include "server/io/side_files.h"
#include "server/io/tet_import.h"

namespace crumple::io {
namespace {

namespace fs = std::filesystem;

std::unexpected<Error> outside(const std::string& name) {
  return invalid("", "is \"" + name + "\", must be a relative path inside the scene's folder");
}

// What a reader says about the file, as the fault of the field that names it.
std::unexpected<Error> fault_of(const std::string& name, const Error& error) {
  return invalid("", "is \"" + name + "\", which does not do: " + error.text());
}

bool is_asset(const fs::path& file) { return has_ending(file, {".crumple-asset", ".json"}); }

template <class Content>
Result<Content> from_asset(const std::string& name, const fs::path& file, const char* kind) {
  Result<Asset> asset = read_asset(file);
  if (!asset) return fault_of(name, asset.error());
  if (auto* content = std::get_if<Content>(&asset->content)) return std::move(*content);
  return invalid("", "is \"" + name + "\", which holds another kind of asset, must hold " + kind);
}

}  // namespace

Result<fs::path> SceneFolder::resolve(const std::string& name) const {
  if (!is_inside_name(name)) return outside(name);
  std::error_code failure;
  const fs::path folder = fs::canonical(folder_.empty() ? fs::path(".") : folder_, failure);
  if (failure) return invalid("", "is \"" + name + "\", but the scene's folder cannot be read");
  const fs::path file = fs::weakly_canonical(folder / name, failure);
  if (failure || !lies_inside(file, folder)) return outside(name);
  return file;
}

Result<sim::SurfaceMesh> SceneFolder::surface(const std::string& name) const {
  const Result<fs::path> file = resolve(name);
  if (!file) return std::unexpected(file.error());
  if (is_asset(*file)) return from_asset<sim::SurfaceMesh>(name, *file, "a surface");
  Result<ImportedSurface> imported = import_surface(*file);
  if (!imported) return fault_of(name, imported.error());
  return std::move(imported->mesh);
}

Result<sim::TetMesh> SceneFolder::tets(const std::string& name) const {
  const Result<fs::path> file = resolve(name);
  if (!file) return std::unexpected(file.error());
  if (is_asset(*file)) return from_asset<sim::TetMesh>(name, *file, "a tet mesh");
  Result<ImportedTets> imported = import_tets(*file);
  if (!imported) return fault_of(name, imported.error());
  return std::move(imported->mesh);
}

Result<sim::example_based::ExampleSet> SceneFolder::examples(const std::string& name) const {
  const Result<fs::path> file = resolve(name);
  if (!file) return std::unexpected(file.error());
  if (!is_asset(*file)) return invalid("", "is \"" + name + "\", must be an asset file (.crumple-asset or .json)");
  return from_asset<sim::example_based::ExampleSet>(name, *file, "an example set");
}

}  // namespace crumple::io
