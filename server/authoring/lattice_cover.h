#pragma once

#include "server/authoring/bcc_lattice.h"
#include "server/authoring/surface_distance.h"
#include "server/authoring/winding_number.h"

namespace crumple::authoring {

inline constexpr std::int64_t kMaxCells = 4'000'000;

// A lattice of cell size h around the surface's box, which it covers with one cell to spare, centred on it.
BccLattice lattice_around(const sim::SurfaceMesh& surface, double h);

enum class Cover : std::uint8_t { outside, cut, solid };

// What each tet slot of a lattice is to a surface: cut by it (a piece of a triangle of non-zero area lies in the tet,
// or it is the tet of a vertex that no such tet holds), otherwise in the solid or outside of it by the winding number
// at its centroid (or, where all four tets around an edge are uncut, in their middle). One entry a slot.
std::vector<Cover> classify(const BccLattice& lattice, const sim::SurfaceMesh& surface, const WindingNumber& solid,
                            const SurfaceDistance& distance);

}  // namespace crumple::authoring
