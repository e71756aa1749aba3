#pragma once

#include "server/lab/benchmark.h"

namespace crumple::lab {

// Steps a scene and looks at the impulses that its example-based bodies take, contact by contact and step by step, bodies of the same
// asset and mass together. Suggests what they tell of two parameters of Jones et al. 2016:
//   beta   95 % of the impulses stay below it, and twice what carries the body's weight in a step (m |g| dt) does
//   alpha  an impulse that one in a thousand exceeds moves a whole example's way: alpha (dt_ref / m) (j - beta) = 1  [eqs. 4, 8]
// Per group: bodies, mass [kg], impulses (count, quantiles [N s]), and beta, alpha as they are and as suggested; null where no
// impulse is above the suggested beta.
// Errors: World::create's; a scene without example-based bodies.
Result<Json> suggest_parameters(const sim::SceneDescription& scene, const BenchmarkOptions& options);

}  // namespace crumple::lab
