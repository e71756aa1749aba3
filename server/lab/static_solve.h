#pragma once

#include "server/lab/yardstick_case.h"

namespace crumple::lab {

enum class Model { linear, corotational };
enum class Precision { single, double_ };

struct StaticSolution {
  std::vector<Vec3> displacements;  // one a node [m]
  std::vector<Vec3> reactions;      // one a node [N]: what the supports push with; 0 where a dof is free
  bool converged = false;
  double residual = 0;              // |r_free| / max(|f_ext|, |f_int|)
  int iterations = 0;               // Newton's, over all load steps
};

// Static equilibrium of a level's mesh under its supports and dead loads: K u = f (linear), or Newton's method on the
// corotational forces with the exact tangent until |r_free| <= 1e-10 max(|f_ext|, |f_int|), or until it no longer falls
// and is what the rounding of positions leaves (small loads on stiff bodies); the load in steps where it does not
// converge at once. Precision is that of matrix and factor: in single, the linear answer has single accuracy,
// and Newton, whose forces stay double, needs more iterations. Errors: those of rest_body.
Result<StaticSolution> solve_static(const Level& level, const Material& material, Model model, Precision precision);

}  // namespace crumple::lab
