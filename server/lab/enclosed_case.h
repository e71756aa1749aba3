#pragma once

#include "server/lab/yardstick_case.h"
#include "server/sim/mesh/embedding.h"

#include <span>
#include <vector>

namespace crumple::lab {

// A stored case that hangs by its own weight, carried by an enclosing lattice (authoring/enclosing_mesh.h) instead of the mesh that
// fits its surface: what the product makes of a surface that has no tets.
struct EnclosedCase {
  // The lattice. What lies higher, against gravity, than the lowest held node of the stored mesh is held where it is, in all
  // three directions.
  Level level;
  sim::Embedding embedding;  // of the stored mesh's nodes

  // Displacements of the stored mesh's nodes [m].
  std::vector<Vec3> carried(std::span<const Vec3> displacements) const;
};

// gravity [m/s^2], density [kg/m^3], cell_size [m]. Errors: no gravity, a mesh without a held node or a lattice of which none is
// held, and those of enclosing_mesh.
Result<EnclosedCase> enclose(const Level& stored, const Vec3& gravity, double density, double cell_size);

}  // namespace crumple::lab
