#include "server/sim/example_based/example_state.h"

namespace crumple::sim::example_based {

ExampleState make_state(const ExampleRest& rest, const ExampleParameters& parameters) {
  ExampleState state;
  state.E = WeightMatrix::Zero(rest.vertex_count(), rest.example_count());
  state.E.col(0).setOnes();
  state.dE = WeightMatrix::Zero(rest.vertex_count(), rest.example_count());
  state.x = rest.x_rest;
  state.restitution = parameters.restitution;
  return state;
}

}  // namespace crumple::sim::example_based
