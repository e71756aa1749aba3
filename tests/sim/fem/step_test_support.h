#pragma once

#include "tests/sim/fem/fem_test_support.h"

#include <cmath>

// What tests of the steps of one body share.
namespace crumple::sim::fem::test {

inline StepOptions tight(double dt) {
  StepOptions options;
  options.dt = dt;
  options.solve = {1e-12, 10000};
  return options;
}

inline std::vector<PrescribedNode> hold_left_end(const TetMesh& mesh) {
  std::vector<PrescribedNode> held;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (mesh.X[i].x() < 1e-9) held.push_back({i, Vec3::Zero()});
  return held;
}

// The breathing mode of a free regular tet stays F = (1 + a) I, so that eq. 5 is linear at any amplitude:
// omega^2 = V (9 lambda + 6 mu) / sum m |X|^2.
struct Breathing {
  TetMesh mesh = regular_tet();
  FemMaterial material;
  RestBody rest;
  FemState state;
  double omega;

  explicit Breathing(double alpha = 0, double beta = 0) {
    material.young = 2e4;
    material.damping_mass = alpha;
    material.damping_stiffness = beta;
    rest = rest_body(mesh, material);
    state = rest_state(mesh);
    const Lame lame = lame_constants(material.young, material.poisson);
    omega = std::sqrt((9 * lame.lambda + 6 * lame.mu) / (3 * material.density));  // |X|^2 = 3, V/mass = 1/rho
  }
  double amplitude() const { return state.x[0].dot(mesh.X[0]) / 3 - 1; }
  double rate() const { return state.v[0].dot(mesh.X[0]) / 3; }
  void start(double a, double rate) {
    for (int i = 0; i < 4; ++i) {
      state.x[i] = (1 + a) * mesh.X[i];
      state.v[i] = rate * mesh.X[i];
    }
  }
};

}  // namespace crumple::sim::fem::test
