#pragma once

#include "common/types.h"
#include "crumple/v1/scene.pb.h"

#include <array>
#include <string>

// What the scenes that crumple-rig writes are put together of.
namespace crumple::rig {

inline constexpr double kAssetDensity = 150;  // [kg/m^3], of sheet metal and air
inline constexpr double kGravity = 9.81;      // a scene's default [m/s^2]

v1::Body& add_body(v1::Scene& scene, const std::string& name, const Vec3& position, const std::array<float, 3>& colour);
void add_ground(v1::Scene& scene);

// Parameters in proportion to a body's size [m], its mass [kg] and the speed at which it is to dent [m/s]: those of the
// barrels in the paper's scene, scaled (48 / m and 0.667 m at a size of 0.76 m, 21 N s at 216 kg and 7 m/s).
void set_parameters(v1::ExampleBody& body, double size, double mass, double speed);

}  // namespace crumple::rig
