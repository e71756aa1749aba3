#include "server/sim/fem/float_matrix.h"

#include <algorithm>

namespace crumple::sim::fem {

double stiffness_over_mass(const RestBody& rest, double dt) {
  double most = 0;
  for (int t = 0; t < rest.tet_count(); ++t) {
    const FemMaterial& material = rest.material_of(t);
    const double modulus = rest.lame_of(t).lambda + 4 * rest.lame_of(t).mu;
    const double factor = (dt * material.damping_stiffness + dt * dt) / (3 * material.density);
    most = std::max(most, factor * modulus * rest.gradients(t).squaredNorm());
  }
  return most;
}

bool takes_float(const RestBody& rest, double dt) {
  constexpr int kNodes = 500;
  return rest.node_count() >= kNodes && stiffness_over_mass(rest, dt) <= kFloatStiffness;
}

}  // namespace crumple::sim::fem
