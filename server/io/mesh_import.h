#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <filesystem>

namespace crumple::io {

// Size limit of a mesh file [bytes]; larger ones are refused unread.
inline constexpr std::uintmax_t kMaxMeshFileBytes = 512u << 20;

struct ImportedSurface {
  sim::SurfaceMesh mesh;
  int degenerate_triangles = 0;  // dropped: two corners in one place, or no area
  int merged_vertices = 0;       // vertices that lay exactly where another one was
  std::vector<Vec3> colours;     // one a vertex: red, green, blue in [0, 1], of merged ones the mean; or empty
};

// Reads a triangle surface: OBJ, glTF 2 (.gltf, .glb), PLY, STL, OFF or FBX, by the file's ending. All meshes of the
// file, each as often as its scene places it and where it does (mirroring placements keep the outside outside);
// polygons are triangulated, lines and points left out, equal positions merged. Colours are those of vertices, as the
// file has them (white where only other meshes of it have some); textures, skins and animations are not looked at.
// Positions pass through single precision, except in PLY and OFF. Units are the file's: nothing is scaled. Errors,
// naming the file and the reason: no such file, too large, an ending or a content that cannot be read, no triangle in
// it, a colour that is not finite, a file that it names outside of its folder, what validate(SurfaceMesh) rejects.
Result<ImportedSurface> import_surface(const std::filesystem::path& file);

}  // namespace crumple::io
