#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <string>
#include <string_view>

namespace crumple::io {

// The vertices and faces of an ASCII OFF file (also COFF, NOFF, STOFF: what follows a position on its line is passed
// over, as are colours behind a face); polygons cut into triangles. Read here and not by Assimp, which reads past the
// end of a face that is cut off. Errors name file, line and value.
Result<sim::SurfaceMesh> read_off(std::string_view content, const std::string& name);

}  // namespace crumple::io
