#pragma once

#include "common/types.h"

#include <array>
#include <vector>

namespace crumple::sim::fem {

// What changes in a step of one finite-element body; a snapshot copies this and no rest data.
struct FemState {
  std::vector<Vec3> x;               // node positions in W [m]
  std::vector<Vec3> v;               // node velocities in W [m/s]
  // eps^P, one an element (a tet or a group of tets), in its unrotated axes [-]. Empty: all zero, of a body that does not yield.
  std::vector<Mat3> plastic_strain;
  // One step back, for formulas of two steps (bdf2.h). Empty: nothing is remembered.
  std::vector<Vec3> x_before = {};   // [m]
  std::vector<Vec3> v_before = {};   // [m/s]
  int rough_steps = 0;               // still to come, that are not to be remembered
};

inline const std::array<Mat3, 4> kNoPlasticStrain{Mat3::Zero(), Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};

// Those of elements e to e + 3, all there; and that of element e.
inline const Mat3* four_plastic_strains(const std::vector<Mat3>& plastic_strain, int e) {
  return plastic_strain.empty() ? kNoPlasticStrain.data() : &plastic_strain[e];
}
inline const Mat3& plastic_strain_at(const std::vector<Mat3>& plastic_strain, int e) { return *four_plastic_strains(plastic_strain, e); }

}  // namespace crumple::sim::fem
