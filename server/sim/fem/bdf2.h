#pragma once

#include "server/sim/fem/implicit_euler.h"

// The backward differentiation formula of two steps, second order in time [Hairer, Wanner: Solving Ordinary Differential
// Equations II, ch. V.1],
//   v+ = 4/3 v - 1/3 v_before + 2/3 dt a+,   x+ = 4/3 x - 1/3 x_before + 2/3 dt v+,
// with the elastic force linearised at the predicted position x + dt v: one linear system, as backward Euler has one.
// Linearised at x it would lose most of what it gains.
//
// It goes on with a third of the acceleration of the step before. Where that jumped (an impulse, a contact, a split) it
// would give a third of the jump once more: such a step is rough, taken by backward Euler and not remembered. Plastic flow
// and driven nodes that start or stop are no reason: restarts there make errors larger or leave them.
namespace crumple::sim::fem {

struct Bdf2Scratch {
  std::vector<Vec3> w, x_known, x_predicted;
};

inline bool remembers(const FemState& state) { return !state.x_before.empty(); }
void forget(FemState& state);  // as if nothing had been before

// The coming `steps` steps, this one included if it is not yet assembled, are rough. What is remembered is forgotten; not
// to be called between assembly and advance.
void restart(FemState& state, int steps = 1);

// Before a step: restarts for kRoughAfterInversion steps if some tet has det F < 0.2 at x or at x + dt v. BDF2 rings long
// after a scramble; backward Euler damps it.
inline constexpr int kRoughAfterInversion = 60;
void restart_near_inversion(const RestBody& rest, const std::vector<Tet>& tets, double dt, const ThreadPool& pool,
                            FemState& state);

// In the terms of assembly.h: c = 3/2, w = 2 v - 1/2 v_before, theta = 2/3, x_known = 4/3 x - 1/3 x_before. The state must
// remember a step of the same dt. Borrows `scratch`.
StepFormula bdf2_formula(const FemState& state, double dt, std::span<const PrescribedNode> prescribed,
                         Bdf2Scratch& scratch);

StepSystem::Scale bdf2_scale(double dt);  // of its systems

// A solve's tolerance for a step of BDF2 over that for one of backward Euler: what a solve misses of v+ is handed on to
// half again as much in the steps after it.
inline constexpr double kBdf2Tolerance = 2.0 / 3;

// After a step: v := v+, x := x+ by BDF2 if the state remembers a step, else by backward Euler; prescribed nodes by x + dt
// v+. A step that was not rough is remembered. v_plus: 3n [m/s]; prescribed: one a node.
void advance_bdf2(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt, std::span<const char> prescribed,
                  FemState& state);

// One step of a single body without contact, as implicit_euler_step does it. f_ext must not jump between steps.
linear_solver::SolveReport bdf2_step(const RestBody& rest, const std::vector<Tet>& tets, FemState& state,
                                     Eigen::Ref<const Eigen::VectorXd> f_ext,
                                     std::span<const PrescribedNode> prescribed, const StepOptions& options,
                                     const ThreadPool& pool, StepScratch& scratch, Bdf2Scratch& bdf2);

}  // namespace crumple::sim::fem
