#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::sim::fem {

// What changes in a step of one finite-element body; a snapshot copies this and no rest data.
struct FemState {
  std::vector<Vec3> x;               // node positions in W [m]
  std::vector<Vec3> v;               // node velocities in W [m/s]
  std::vector<Mat3> plastic_strain;  // eps^P, one a tet, in the tet's unrotated axes [-]
};

}  // namespace crumple::sim::fem
