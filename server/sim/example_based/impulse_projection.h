#pragma once

#include "server/sim/example_based/skinning.h"

// From an impulse at one vertex to a change of its example weights: Jones et al. 2016, section 3.2.1.
namespace crumple::sim::example_based {

// |J^T dx| <= this times |J| |dx| counts as orthogonal to every example (eq. 8). The paper compares |J^T dx| [m^2] with
// 1e-8, which depends on the scene's size: a body of 1 mm would never deform.
inline constexpr double kOrthogonal = 1e-6;
inline constexpr double kRawOrthogonal = 1e-8;  // [m^2], the paper's, with raw_rates

// Eq. 9 inverts J's singular values s as s / (s^2 + (kTikhonov s_max)^2): what J^T dx cannot reach is not amplified by
// more than 1 / (2 kTikhonov s_max). With raw_rates it is the paper's thresholded pseudo-inverse, 1 / s where
// s > kRawThreshold s_max, else 0; the paper rejects eq. 9 because nothing good was found for that threshold.
inline constexpr double kTikhonov = 0.05;
inline constexpr double kRawThreshold = 1e-6;

// The time that turns an impulse over mass into a displacement in eq. 4: rate_dt (so that the same impact dents the
// same at every dt), or with raw_rates the step dt, as the paper has it. [s]
double projection_dt(const ExampleParameters& parameters, double dt, double rate_dt);

// dx_i = dt / m max(|j_i| - beta, 0) j_i / |j_i| [m]; eq. 4. j: impulse [N s] in the asset's axes, m: mass [kg].
// Zero where j is.
Vec3 plastic_displacement(const Vec3& j, double dt, double m, double beta);

// de_i [-] by parameters.step:
//   eq. 8   de = alpha |dx| J^T dx / |J^T dx|, zero where dx is orthogonal to all columns   alpha [1/m]
//   eq. 9   de = alpha J^+ dx                                                              alpha [-]
//   eq. 10  de = alpha J^T dx                                                              alpha [1/m^2]
WeightRow weight_change(const ExampleParameters& parameters, const Jacobian& J, const Vec3& dx);

}  // namespace crumple::sim::example_based
