#include "server/sim/fem/plasticity.h"

#include <cassert>
#include <cmath>

namespace crumple::sim::fem {

double creep_per_step(const FemMaterial& material, double dt, double creep_dt) {
  assert(dt > 0 && creep_dt > 0);
  return material.raw_creep ? material.creep : 1 - std::pow(1 - material.creep, dt / creep_dt);
}

bool flow(FlowRule rule, const Mat3& total_strain, double yield, double creep, double max_plastic,
          Mat3& plastic_strain) {
  Mat3 elastic = total_strain - plastic_strain;
  if (rule == FlowRule::deviatoric) elastic -= elastic.trace() / 3 * Mat3::Identity();
  const double norm = elastic.norm();
  if (!(norm > yield)) return false;
  plastic_strain += creep * (norm - yield) / norm * elastic;
  const double plastic_norm = plastic_strain.norm();
  if (plastic_norm > max_plastic) plastic_strain *= max_plastic / plastic_norm;
  return true;
}

double yield_stress(const FemMaterial& m) {
  if (m.flow == FlowRule::deviatoric) return std::sqrt(6.0) * m.young / (2 * (1 + m.poisson)) * m.yield;
  return m.young * m.yield / std::sqrt(1 + 2 * m.poisson * m.poisson);
}

}  // namespace crumple::sim::fem
