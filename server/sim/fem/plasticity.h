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
bool flow(const Mat3& total_strain, double yield, double creep, double max_plastic, Mat3& plastic_strain);

}  // namespace crumple::sim::fem
