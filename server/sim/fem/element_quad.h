#pragma once

#include "server/sim/fem/elements.h"

#include <span>

namespace crumple::sim::fem {

// What update_elements does to tets t .. t + 3, four at once in the lanes of the vector unit; adds their elastic energy
// [J]. False, and nothing done, if one of them needs a path of its own: a clamped basis, QR, or F too near to singular for its polar factor.
// Lanes do not see each other: a tet's results do not depend on its neighbours in the mesh order, but for rounding where one of
// four needs a path of its own.
bool update_element_quad(const RestBody& rest, const std::vector<Tet>& tets, int t, std::span<const Vec3> x,
                         const std::vector<Mat3>& plastic_strain, Elements& elements, double& energy);

// How many of tets t .. t + 3 have a negative determinant of their edges.
int inverted_of_four(const std::vector<Tet>& tets, int t, std::span<const Vec3> x);

}  // namespace crumple::sim::fem
