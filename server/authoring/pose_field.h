#pragma once

#include "common/types.h"

#include <functional>

// Displacement fields that imitate what an artist would pose: dents, crushed ends, kinks.
namespace crumple::authoring {

using PoseField = std::function<Vec3(const Vec3& X)>;  // rest position -> displacement [m]

// A body pushed in along `direction`. With s = direction . X - face the depth of a point behind the pushed side:
//   crush    depth (1 - s / zone)^1.5 for s < zone: the zone shortens, its far end stays
//   flatten  max(0, depth - s), rounded off over a tenth of the depth: what lies before a plane moves onto it
// times a bell exp(-sum ((X_k - centre_k) / footprint_k)^2), and what is pushed in swells by `swell` of the local
// displacement, away from the line through `centre` along `direction`.
struct Dent {
  enum class Profile { crush, flatten } profile = Profile::crush;
  Vec3 direction = -Vec3::UnitX();       // unit, inwards
  double face = 0;                       // direction . X on the pushed side [m]
  double depth = 0.1;                    // [m]
  double zone = 0.5;                     // [m], crush only; above 1.5 depth, or the zone turns inside out
  Vec3 centre = Vec3::Zero();            // [m]
  Vec3 footprint = Vec3::Constant(1e9);  // radii of the bell [m]
  double swell = 0;                      // [-]
};
PoseField dent(const Dent& d);

// A kink: what lies beyond `centre` along the unit `axis` turns about `hinge` by +angle / 2, the other end by
// -angle / 2, eased over `width` [m]; inside the kink the side that is pressed gives way by `pinch` [m].
struct Kink {
  Vec3 axis = Vec3::UnitY();
  Vec3 hinge = Vec3::UnitZ();  // unit, perpendicular to axis
  Vec3 centre = Vec3::Zero();  // [m]
  double angle = 0.6;          // [rad]
  double width = 0.1;          // [m]
  double pinch = 0;            // [m]
};
PoseField kink(const Kink& k);

PoseField sum(PoseField a, PoseField b);

}  // namespace crumple::authoring
