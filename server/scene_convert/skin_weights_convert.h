#pragma once

#include "common/error.h"
#include "common/types.h"
#include "crumple/v1/asset.pb.h"

#include <string>

namespace crumple::scene_convert {

// W, vertices x bones. Errors: bones outside [1, 1024], a form of another size, bone ids out of range or not
// ascending in a row. Whether rows sum to one is for validate(ExampleSet).
Result<Eigen::MatrixXd> to_weights(const v1::SkinWeights& message, int vertices, const std::string& field);

// Sparse where that is shorter, else dense.
v1::SkinWeights to_message(const Eigen::MatrixXd& W);

}  // namespace crumple::scene_convert
