#pragma once

#include "server/sim/example_based/example_state.h"
#include "server/sim/parallel_for.h"

#include <cstdint>
#include <vector>

// Delayed application of the accumulated deformation: Jones et al. 2016, section 3.2.2, eqs. 13 and 14.
namespace crumple::sim::example_based {

// A row of dE whose entries are all within this is applied at once and leaves the active rows: the body stops being
// skinned ("avoiding re-skinning objects when dE becomes negligible", section 5). A vertex then makes a last move of
// at most sqrt(E) |J_i| times this: a tenth of a millimetre where examples are a metre from each other. Nothing is lost, so
// eq. 14 keeps holding.
inline constexpr double kNegligible = 1e-4;
inline constexpr double kRawNegligible = 1e-15;  // with raw_rates

// A row whose entries sum to less than this after clamping has no direction left; it becomes the rest pose.
inline constexpr double kMinRowSum = 1e-12;

// lambda^(dt / rate_dt): the same fade per second at every dt ("should vary with the inverse of the timestep"). With
// raw_rates lambda itself, per step.
double lambda_per_step(const ExampleParameters& parameters, double dt, double rate_dt);

// Clamps row i of E at 0 and scales it to sum 1: the row stays in the simplex of the examples, to rounding.
void normalise_row(WeightMatrix& E, int i);

// E += (1 - lambda) dE, dE *= lambda on the active rows, then `normalise_row` on each. Rows that became negligible
// leave state.active. `changed` receives the vertices whose row of E changed by a bit, ascending. lambda: per step.
void apply_delayed(const ExampleParameters& parameters, double lambda, const ThreadPool& pool, ExampleState& state,
                   std::vector<int>& changed);

}  // namespace crumple::sim::example_based
