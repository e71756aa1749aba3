#pragma once

#include "server/sim/fem/rest_body.h"

namespace crumple::sim::fem {

// What floats bear: a rounding of 6e-8 of what is so many times as stiff as heavy is still far below the mass. STABILITY 8.
inline constexpr double kFloatStiffness = 1e5;

// The diagonal of a tet's stiffness in the matrix of a step over that of its mass, (dt beta + dt^2) (lambda + 4 mu) sum |g_a|^2 / (3 rho),
// of the tet that has most [-]. dt [s].
double stiffness_over_mass(const RestBody& rest, double dt);

// A material that asks for more than this keeps its matrix in double: blocks in float are good to 6e-8 of the stiffness, far from what
// 1e-10 asks for. A body that touches one that asks for more, or that the guard solves more tightly, keeps its float all the same.
inline constexpr double kFloatTolerance = 1e-5;

// Whether the matrix of a step loses nothing to speak of by blocks in float, of which products read half as much: no stiffer than
// kFloatStiffness, and not asked for more than kFloatTolerance.
bool takes_float(const RestBody& rest, double dt);

}  // namespace crumple::sim::fem
