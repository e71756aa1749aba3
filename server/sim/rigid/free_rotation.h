#pragma once

#include "common/types.h"

// Rotation of a rigid body that no torque acts on: its angular momentum L stays, its orientation follows from it.
// P are the body's principal axes, I its moments there [kg m^2].
namespace crumple::sim {

// w = R diag(1/I) R^T L, in W [rad/s].
Vec3 angular_velocity(const Quat& R_WP, const Vec3& I, const Vec3& L_W);
// R diag(I) R^T [kg m^2].
Mat3 world_inertia(const Quat& R_WP, const Vec3& I);
// R exp of the rotation vector `turn` (in W, its length the angle [rad]) applied to R_WP.
Quat turned(const Quat& R_WP, const Vec3& turn);

// Orientation after dt (which may be negative) by the implicit midpoint rule: w_m = w(R_m), R_m = exp(dt/2 w_m) R,
// R+ = exp(dt w_m) R. L_W is kept by construction; the rule is symmetric in time, so the energy does not drift. dt is
// cut so that each part turns by less than about half a radian; where that would take more than 64 parts (a needle,
// whose fixed-point iteration would not converge), 64 parts of the splitting into exact turns about the three principal
// axes take its place, which keeps L_W and the symmetry as well and has nothing to iterate.
Quat rotate_freely(const Quat& R_WP, const Vec3& I, const Vec3& L_W, double dt);

}  // namespace crumple::sim
