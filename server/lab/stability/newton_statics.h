#pragma once

#include "server/lab/stability/soft_trial.h"
#include "server/sim/fem/elements.h"

#include <memory>

// Static equilibrium far from the rest shape, for row 13.
namespace crumple::lab::stability {

// The yardstick's S04: a cantilever of 1 x 0.1 x 0.1 m along x, E = 1e7 Pa, nu = 0, 480 tets, held at x = 0, with a
// dead load on its end, downwards along z, of `times` the 166.7 N (alpha = F L^2 / (E I) = 2) that are stored.
std::unique_ptr<SoftTrial> elastica(const FemMethod& method, double times);

// The static equilibrium of a trial from its rest shape by full Newton steps with one tangent or the other.
struct NewtonRun {
  bool converged = false;  // |r| < 1e-8 |f|
  int iterations = 0;      // up to 100
  double residual = 0;     // |r| / |f| at the end
  std::vector<Vec3> x;     // node positions at the end [m]
};
NewtonRun newton(const SoftTrial& trial, sim::fem::Tangent tangent);

}  // namespace crumple::lab::stability
