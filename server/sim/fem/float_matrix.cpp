#include "server/sim/fem/float_matrix.h"

namespace crumple::sim::fem {

bool takes_float(const RestBody& rest, double dt) {
  constexpr int kNodes = 500;
  constexpr double kStiffness = 1e5;
  if (rest.node_count() < kNodes) return false;
  for (int t = 0; t < rest.tet_count(); ++t) {
    const FemMaterial& material = rest.material_of(t);
    const double modulus = rest.lame_of(t).lambda + 4 * rest.lame_of(t).mu;
    const double factor = (dt * material.damping_stiffness + dt * dt) / (3 * material.density);
    if (!(factor * modulus * rest.gradients(t).squaredNorm() <= kStiffness)) return false;
  }
  return true;
}

}  // namespace crumple::sim::fem
