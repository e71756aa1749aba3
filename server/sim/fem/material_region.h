#pragma once

#include "common/error.h"
#include "server/sim/fem/fem_material.h"

#include <span>
#include <string>
#include <vector>

namespace crumple::sim::fem {

// Tets that are of another material than their body. Friction, the solver's tolerance and cap, how often and how many
// splits are looked for, and raw_toughness go for the whole body: here they must be those of the body's material.
struct MaterialRegion {
  std::vector<int> tets;  // one at least, each in one region alone
  FemMaterial material;
};

// At most so many regions in a body; a tet names its material by 16 bits.
inline constexpr int kMaxRegions = 1000;

// The fields of `from` that go for the whole body, in `to`.
void copy_whole_body_fields(const FemMaterial& from, FemMaterial& to);

// Rejects: too many regions, one without tets, ids outside [0, tet_count), a tet named twice, a field of the whole body
// that differs from the body's material. What a material's numbers may be is checked elsewhere. `field` is the list's path.
Result<void> validate(std::span<const MaterialRegion> regions, const FemMaterial& body, int tet_count,
                      const std::string& field);

}  // namespace crumple::sim::fem
