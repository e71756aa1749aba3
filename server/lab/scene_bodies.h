#pragma once

#include "server/sim/scene.h"

#include <string>

// Bodies that benchmark scenes are put together from.
namespace crumple::lab {

inline constexpr sim::SleepSettings kNeverSleeps{.speed = 0};  // as the programs that scenes are compared with

// A fixed half-space below normal . x = offset [m].
sim::BodyDescription plane_body(const std::string& name, const Vec3& normal, double offset, double friction);

// A rigid body of one shape, density and friction by default.
sim::BodyDescription solid_body(const std::string& name, const sim::Shape& shape, sim::RigidKind kind,
                                const Vec3& position);

}  // namespace crumple::lab
