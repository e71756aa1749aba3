#pragma once

#include "server/sim/fem/macro_states.h"

namespace crumple::sim::fem {

// What update_macros does to closed octahedra d .. d + 3, four at once in the lanes of the vector unit. False, and nothing
// done, if one of them needs a path of its own: tets near inversion or folded, QR, or F too near to singular. Lanes do not see
// each other.
bool update_octahedron_quad(const RestBody& rest, const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain, int d,
                            MacroStates& e);

}  // namespace crumple::sim::fem
