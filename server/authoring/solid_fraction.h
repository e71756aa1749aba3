#pragma once

#include "server/authoring/winding_number.h"

namespace crumple::authoring {

inline constexpr int kFillSamples = 24;

// Fraction of a tet inside the solid (winding number > 1/2) by kFillSamples points that are the same in every tet: the
// R3 low-discrepancy sequence, folded from the cube into the tet without changing volumes. In steps of 1 / 24.
double solid_fraction(const WindingNumber& solid, const std::array<Vec3, 4>& corners);

}  // namespace crumple::authoring
