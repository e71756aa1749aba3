#pragma once

#include "server/sim/scene.h"

#include <span>

namespace crumple::sim {

// The pose a script prescribes at a time [s]: linear in p, slerp in R between keys, held outside. keys: at least one,
// ascending in time.
Pose pose_at(std::span<const PoseKey> keys, double time);

// The constant angular velocity that turns R_from into R_to within dt, the short way [rad/s].
Vec3 angular_velocity_between(const Quat& R_from, const Quat& R_to, double dt);

}  // namespace crumple::sim
