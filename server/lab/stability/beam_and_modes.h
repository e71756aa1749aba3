#pragma once

#include "server/lab/stability/soft_trial.h"

// What a body does as long as it moves little: beams and plates under loads, modes, and what backward Euler makes of
// them.
namespace crumple::lab::stability {

// Tip of a cantilever of 10 x 1 x 1 m (20 x 2 x 2 cells of the method's elements, small deflection, exact solve) over that of
// Euler and Bernoulli's beam with Timoshenko's shear, which does not depend on nu but through the shear modulus. Below
// 1: locking.
double cantilever_ratio(const FemMethod& method, double poisson);

// Cook's membrane in plane strain, a corner's deflection over that of quadratic tets on 32 x 32 cells (the yardstick's
// S10, CalculiX). across: cells along a side, 8 is S10's L0, 16 its L1. poisson: 0.3, 0.49 or 0.4999. Below 1: locking.
double cook_ratio(const FemMethod& method, double poisson, int across);

// Lowest elastic frequencies of a free body of at most some hundred nodes and its modes, lumped mass.
struct Mode {
  double omega = 0;       // [rad/s]
  Eigen::VectorXd shape;  // 3n, largest entry 1
};
std::vector<Mode> free_modes(const SoftTrial& trial, int count);

// A linear mode q'' = load - omega^2 q after `steps` steps of an integrator's formula. Backward Euler: v+ = (v + dt (load -
// omega^2 q)) / (1 + (omega dt)^2), q+ = q + dt v+ [FORMULAS F2]. BDF2: the same after a first step of that with 4/3 q - 1/3
// q_before for q, 4/3 v - 1/3 v_before for v and 2/3 dt for dt.
struct ModeState {
  double q = 0, v = 0;
};
ModeState mode_after(sim::Integrator integrator, double omega2, double load, ModeState start, double dt, int steps);

// Kinetic and elastic energy [J] of a body that starts at rest under its trial's forces and nodes held fixed, after
// `steps` steps of its method's integrator in small deflection: mode by mode. For some hundred nodes.
double energy_by_modes(const SoftTrial& trial, double dt, int steps);

}  // namespace crumple::lab::stability
