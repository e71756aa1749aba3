#pragma once

#include "server/sim/example_based/example_state.h"

// Restitution that drops while a body crumples: Jones et al. 2016, section 3.3, eq. 15.
namespace crumple::sim::example_based {

// A Frobenius norm of dE grows with the square root of the vertex count, and with it what a given nu does. Unless
// raw_rates, the norm is therefore that of an equal-share mesh with this many vertices (the paper's have 1,200 to
// 4,700), so that nu keeps the paper's scale and a finer mesh restores as a coarse one does.
inline constexpr double kNormVertices = 1000;

// ||dE||_f = sqrt(sum_i |dE_i|^2) with raw_rates, else sqrt(kNormVertices sum_i share_i |dE_i|^2), share_i the vertex's
// share of the mass: on N vertices of equal share that is ||dE||_f sqrt(kNormVertices / N). Only active rows count.
double accumulator_norm(const ExampleRest& rest, const ExampleParameters& parameters, const ExampleState& state);

// C_r := min(C_r^*, C_r + mu dt, exp(-nu ||dE||_f) C_r^*); eq. 15. `norm` is that of dE with this step's impulses,
// before any of it is applied. dt: the step [s].
double update_restitution(const ExampleParameters& parameters, double C_r, double dt, double norm);

}  // namespace crumple::sim::example_based
