#include "server/sim/example_based/restitution.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::example_based {

double accumulator_norm(const ExampleRest& rest, const ExampleParameters& parameters, const ExampleState& state) {
  double sum = 0;
  for (int i : state.active) {
    const double share = parameters.raw_rates ? 1 : kNormVertices * rest.vertex_share[i];
    sum += share * state.dE.row(i).squaredNorm();
  }
  return std::sqrt(sum);
}

double update_restitution(const ExampleParameters& parameters, double C_r, double dt, double norm) {
  const double C_r_star = parameters.restitution;
  return std::min({C_r_star, C_r + parameters.mu * dt, std::exp(-parameters.nu * norm) * C_r_star});
}

}  // namespace crumple::sim::example_based
