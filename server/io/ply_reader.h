#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <string>
#include <string_view>

namespace crumple::io {

struct PlyMesh {
  sim::SurfaceMesh surface;
  std::vector<Vec3>
      colours;  // one a vertex: red, green, blue in [0, 1], whole numbers by their type's largest; or empty
};

// The vertices, their colours, and the faces of a PLY file (1.0; ASCII, binary little- or big-endian); other elements
// and properties are passed over, polygons cut into triangles. Read here and not by Assimp, which never returns from a
// cut-off header. Errors name file, line or element, and value.
Result<PlyMesh> read_ply(std::string_view content, const std::string& name);

}  // namespace crumple::io
