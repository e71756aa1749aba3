#pragma once

#include "common/types.h"

#include <span>

namespace crumple::authoring {

// Skinning weights of generated rigs: normalised Gaussians of the distance to each bone,
//   W_ib = exp(-|u_i - c_b|^2 / (2 s^2)) / sum_b ...,    s = 0.55 of the mean distance from a bone to its nearest
//   other.
// In [0, 1], rows sum to 1. Halfway between two bones the weight falls about as steeply as linear interpolation would,
// where example_based::distance_weights has a plateau around each bone, which shows as steps in a posed surface.
// vertices: N [m]. bones: B >= 1 [m]. Returns N x B.
Eigen::MatrixXd handle_weights(std::span<const Vec3> vertices, std::span<const Vec3> bones);

}  // namespace crumple::authoring
