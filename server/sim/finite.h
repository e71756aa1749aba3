#pragma once

#include <Eigen/Core>

namespace crumple::sim {

// allFinite() by the vector unit: zero times anything else is not a number.
inline bool all_finite(Eigen::Ref<const Eigen::VectorXd> v) { return (0 * v.array()).sum() == 0; }

}  // namespace crumple::sim
