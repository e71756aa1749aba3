#include "server/sim/fem/float_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crumple::sim::fem {

double stiffness_over_mass(const RestBody& rest, double dt) {
  double most = 0;
  for (int t = 0; t < rest.tet_count(); ++t) {
    const FemMaterial& material = rest.material_of(t);
    const double modulus = rest.lame_of(t).lambda + 4 * rest.lame_of(t).mu;
    const double factor = (dt * material.damping_stiffness + dt * dt) / (3 * material.density);
    const double own = factor * modulus * rest.gradients(t).squaredNorm();
    if (!std::isfinite(own)) return std::numeric_limits<double>::infinity();
    most = std::max(most, own);
  }
  return most;
}

bool takes_float(const RestBody& rest, double dt) {
  return rest.material.cg_tolerance >= kFloatTolerance && stiffness_over_mass(rest, dt) <= kFloatStiffness;
}

}  // namespace crumple::sim::fem
