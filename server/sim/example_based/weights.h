#pragma once

#include "common/types.h"

#include <span>

namespace crumple::sim::example_based {

// Skinning weights for bodies without authored ones, by distance alone: W_ib = |u_i - c_b|^-4 / sum_b |u_i - c_b|^-4
// (Shepard's interpolation). Smooth, in [0, 1], 1 at the bone itself; rows sum to 1 within 1e-12. They do not know the
// shape: weight leaks across gaps, where bounded biharmonic weights do not. Bones in one place share its weight.
// vertices: N [m]. bones: B >= 1 [m]. Returns N x B.
Eigen::MatrixXd distance_weights(std::span<const Vec3> vertices, std::span<const Vec3> bones);

}  // namespace crumple::sim::example_based
