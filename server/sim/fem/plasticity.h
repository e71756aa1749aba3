#pragma once

#include "common/types.h"
#include "server/sim/fem/fem_material.h"

namespace crumple::sim::fem {

// The creep rate c of one update of eq. 3 for a step dt [s]: c_dt = 1 - (1 - c)^(dt / creep_dt), so that the flow in a
// given time does not depend on dt (DESIGN decision 7); c itself if the material asks for the paper's raw form.
double creep_per_step(const FemMaterial& material, double dt, double creep_dt);

// Additive plasticity (Parker & O'Brien 2009, eq. 3): eps^E = eps~ - eps^P; where its Frobenius norm exceeds yield,
//   eps^P := eps^P + c (|eps^E| - y) / |eps^E| eps^E,
// then |eps^P| is cut back to max_plastic (the paper's clamp means eps^P := n eps^P / |eps^P|). True if it
// flowed.
// FlowRule::deviatoric puts dev eps^E in the place of eps^E: a radial return, whose yield surface is von Mises' with
// sigma_y = sqrt(6) mu y (the paper's agrees with it in pure shear and in nothing else: it yields under pressure, too).
// tr eps^P stays zero, so that volume is kept to first order: det(I + eps^P) = 1 - |eps^P|^2 / 2 + O(|eps^P|^3), which
// is 4.5 % at |eps^P| = 0.3.
bool flow(FlowRule rule, const Mat3& total_strain, double yield, double creep, double max_plastic,
          Mat3& plastic_strain);

// Whether forces of a tet of this plastic strain have their moment balanced (corotational.h): the paper's do not.
inline bool balances_moment(const FemMaterial& material, const Mat3& plastic_strain) {
  return material.flow == FlowRule::deviatoric && !plastic_strain.isZero(0);
}

// The uniaxial stress at which it begins to flow [Pa]: E y / sqrt(1 + 2 nu^2), or sqrt(6) mu y of the deviatoric rule.
double yield_stress(const FemMaterial& material);

}  // namespace crumple::sim::fem
