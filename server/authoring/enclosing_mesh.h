#pragma once

#include "common/error.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::authoring {

struct EnclosingOptions {
  double cell_size = 0;        // edge of a lattice cell [m]; 0: the finest that stays within tet_budget
  int tet_budget = 5000;       // used where cell_size is 0
  double minimum_fill = 0.02;  // floor of TetMesh::fill, so that open sheets and slivers of solid keep stiffness and
                               // mass: an open sheet of no thickness acts like a plate of about 0.03 cells
};

// What was made, and what a user should know about it.
struct EnclosingReport {
  double cell_size = 0;   // [m]
  int cut_tets = 0;       // tets that the surface passes through
  int floored_tets = 0;   // tets whose fill was raised to minimum_fill
  int bodies = 0;         // parts that hang together by faces; each is a separate body to a solver
  int pinched_nodes = 0;  // nodes where tets meet that are not joined by faces around the node: hinges without
                          // bending stiffness. Kept as they are
};

struct EnclosingMesh {
  sim::TetMesh mesh;
  EnclosingReport report;
};

// A tet mesh that encloses any surface: closed or open, in many parts, self-intersecting. Of a BCC lattice
// (bcc_lattice.h), centred on the surface's box, those tets are kept that the surface passes through or that lie in
// the solid (winding number > 1/2); each keeps the fraction of it that is solid. Every vertex lies in some tet.
// Deterministic. Errors: what validate(SurfaceMesh) rejects, a surface without extent, a cell size that gives more
// than kMaxTets tets or 4 million cells, a budget too small for any mesh.
Result<EnclosingMesh> enclosing_mesh(const sim::SurfaceMesh& surface, const EnclosingOptions& options = {});

}  // namespace crumple::authoring
