#pragma once

#include "server/authoring/cell_parts.h"
#include "server/authoring/polyhedron.h"
#include "server/sim/mesh/surface_mesh.h"

#include <optional>

namespace crumple::authoring {

// Cuts the surface that is drawn along the cells of a prescored asset and closes it on their walls: a closed surface
// along itself, an open one by the cut tets.
class PartSurfaces {
 public:
  explicit PartSurfaces(const sim::SurfaceMesh& render);

  // One surface a mesh. meshes: tets of those parts of the cell that are kept, by which what is drawn finds its part.
  // kept: which of these each part is, -1: none.
  std::vector<sim::SurfaceMesh> cut(const SplinterCell& cell, const CellParts& own, const std::vector<int>& kept,
                                    const std::vector<const sim::TetMesh*>& meshes) const;

 private:
  const sim::SurfaceMesh& render_;
  std::optional<Polyhedron> closed_;  // the surface, if it is
};

}  // namespace crumple::authoring
