#pragma once

#include "server/lab/stability/soft_trial.h"

namespace crumple::lab::stability {

// Tip of a cantilever of 10 x 1 x 1 m (20 x 2 x 2 cells, linear tets, small deflection, exact solve) over that of
// Euler and Bernoulli's beam with Timoshenko's shear, which does not depend on nu but through the shear modulus. Below
// 1: locking.
double cantilever_ratio(double poisson);

// Lowest elastic frequencies of a free body of at most some hundred nodes and its modes, lumped mass.
struct Mode {
  double omega = 0;       // [rad/s]
  Eigen::VectorXd shape;  // 3n, largest entry 1
};
std::vector<Mode> free_modes(const SoftTrial& trial, int count);

}  // namespace crumple::lab::stability
