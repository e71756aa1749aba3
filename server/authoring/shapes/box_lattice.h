#pragma once

#include "common/error.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::authoring {

// How a cell of a box is cut into tets.
//   femfx  6 tets: with cell corners v0=(i,j,k), v1=(i+1,j,k), v2=(i+1,j,k+1), v3=(i,j,k+1) and v4..v7 the same at j+1,
//          (v0 v1 v3 v4)(v1 v3 v4 v5)(v3 v5 v7 v4)(v1 v2 v3 v5)(v3 v2 v7 v5)(v2 v7 v5 v6); k counts towards -z
//   kuhn   6 tets around the diagonal from the minimum to the maximum corner, one a way along the axes
//   bcc    12 tets: four around each edge between two cells' centres (bcc_lattice.h); towards the outside two from the
//          centre to the halves of each face
enum class Lattice { femfx, kuhn, bcc };

struct BoxLattice {
  Vec3 size = Vec3::Ones();           // [m]
  std::array<int, 3> cells{1, 1, 1};  // along x, y, z
  Lattice lattice = Lattice::kuhn;
  Vec3 minimum = Vec3::Constant(-0.5);  // minimum corner [m]
};

// Nodes of the cell corners come first, id (i (ny + 1) + j)(nz + 1) + k; then, for bcc, the centres, i ny nz + j nz +
// k. Errors: a size that is not positive and finite, cells below 1, more than kMaxTets tets.
Result<sim::TetMesh> box_mesh(const BoxLattice& box);

// Box centred on the origin.
Result<sim::TetMesh> centred_box_mesh(const Vec3& size, const std::array<int, 3>& cells, Lattice lattice);

// A beam along x: x in [0, Lx], y in [0, Ly], z in [-Lz, 0].
Result<sim::TetMesh> beam(const Vec3& size, const std::array<int, 3>& cells, Lattice lattice);

// A thin upright box centred on the origin, of the given width (x), height (y) and thickness (z).
Result<sim::TetMesh> pane(double width, double height, double thickness, const std::array<int, 3>& cells,
                          Lattice lattice);

}  // namespace crumple::authoring
