#include "server/io/tet_import.h"

#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"
#include "server/io/side_files.h"

namespace crumple::io {

Result<ImportedTets> import_tets(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  if (!has_ending(file, {".node", ".ele", ".msh", ".veg"}))
    return invalid(name, "is not a tet mesh file: its ending must be .node, .ele, .msh or .veg");
  const bool tetgen = has_ending(file, {".node", ".ele"});
  for (const char* ending : {".node", ".ele"}) {
    const std::filesystem::path side = std::filesystem::path(file).replace_extension(ending);
    if (tetgen && !lies_inside(side, file.parent_path()))
      return invalid(side.filename().string(), "is a link that leads out of its folder");
  }
  const std::filesystem::path first = tetgen ? std::filesystem::path(file).replace_extension(".node") : file;
  const auto content = read_whole(first, kMaxMeshFileBytes);
  if (!content) return std::unexpected(content.error());
  if (has_ending(file, {".msh"})) return read_gmsh(*content, name);
  if (has_ending(file, {".veg"})) return read_vega(*content, name);

  const std::filesystem::path second = std::filesystem::path(file).replace_extension(".ele");
  const auto elements = read_whole(second, kMaxMeshFileBytes);
  if (!elements) return std::unexpected(elements.error());
  return read_tetgen(*content, *elements, first.filename().string(), second.filename().string());
}

}  // namespace crumple::io
