#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::sim::fem {

// What changes in a step of one finite-element body; a snapshot copies this and no rest data.
struct FemState {
  std::vector<Vec3> x;               // node positions in W [m]
  std::vector<Vec3> v;               // node velocities in W [m/s]
  std::vector<Mat3> plastic_strain;  // eps^P, one an element (a tet or a group of tets), in its unrotated axes [-]
  // One step back, for formulas of two steps (bdf2.h). Empty: nothing is remembered.
  std::vector<Vec3> x_before = {};   // [m]
  std::vector<Vec3> v_before = {};   // [m/s]
  int rough_steps = 0;               // still to come, that are not to be remembered
};

}  // namespace crumple::sim::fem
