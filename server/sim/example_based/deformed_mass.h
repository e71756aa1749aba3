#pragma once

#include "server/sim/example_based/example_rest.h"

#include <span>

namespace crumple::sim::example_based {

// What the rigid room needs of a shape. Jones et al. 2016, section 3.2.2: "We also update the moment of inertia to
// account for changes in mass distribution"; the mass is constant, so a tet that shrinks becomes denser.
struct DeformedMass {
  double mass = 0;              // [kg]
  Vec3 com = Vec3::Zero();      // centre of mass [m] in the asset's axes
  Mat3 inertia = Mat3::Zero();  // about the centre of mass, in the asset's axes [kg m^2]
};

// Each tet keeps its rest mass, spread evenly over its deformed shape: second moment m / 20 (sum_k x_k x_k^T + s s^T),
// s = sum_k x_k. Exact for the piecewise linear shape, and positive semi-definite for inverted and flat tets as well;
// singular only where the whole body has collapsed to a line. x: N [m]. The default.
DeformedMass deformed_mass(const ExampleRest& rest, std::span<const Vec3> x, double mass);

// The same with a quarter of each tet's mass at each of its vertices: cheaper, and too large by O(edge^2).
DeformedMass lumped_mass(const ExampleRest& rest, std::span<const Vec3> x, double mass);

// Tets whose volume is below 0 in shape x: where the skin passes through itself. Reported, not repaired; the shape is
// used only for collision and drawing (Jones et al. 2016, section 5).
int inverted_tets(const ExampleRest& rest, std::span<const Vec3> x);

}  // namespace crumple::sim::example_based
