#pragma once

#include "server/authoring/polyhedron.h"
#include "server/authoring/splinter_cells.h"
#include "server/sim/mesh/splinters.h"
#include "server/sim/mesh/tet_mesh.h"

// Surfaces in splinters (server/sim/mesh/splinters.h).
namespace crumple::authoring {

// Cuts the solid along the cells. A cell that holds several parts of it makes several splinters. INVALID, with field `size`,
// if that makes more than two million triangles.
Result<sim::SplinterMesh> cut_splinters(const Polyhedron& solid, const std::vector<SplinterCell>& cells);

// As its author parted it: triangles that hang together by common vertex ids are one splinter. Triangles of two splinters
// whose corners are at the same places, to a millionth of the surface's size, lie against each other.
sim::SplinterMesh given_splinters(const sim::SurfaceMesh& surface);

// The surface of a tet mesh: the vertices on it alone.
sim::SurfaceMesh surface_of(const sim::TetMesh& mesh);

}  // namespace crumple::authoring
