#pragma once

#include "server/sim/mesh/surface_mesh.h"

namespace crumple::authoring::car {

// All in the reference car's own metres: 4.2 long, 1.7 wide, 1.4 high.
inline constexpr double kFrontAxle = 1.28, kRearAxle = -1.26;  // x of the wheels [m]
inline constexpr double kWheelRadius = 0.32, kArchRadius = 0.385, kWheelWidth = 0.22;

// Body shell with bonnet, cabin and boot: cross-sections along x, closed by a nose and a tail.
sim::SurfaceMesh body_shell();

}  // namespace crumple::authoring::car
