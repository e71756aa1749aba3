#pragma once

#include "server/lab/yardstick_case.h"

namespace crumple::lab {

// Replays a case of example-based plasticity frame by frame, by the paper's raw forms: {"outputs": {...}} with every intermediate
// of Jones et al. 2016, eqs. 1-15 (signs, masses; per frame and impulse dx, J, J^T dx, de, distances; dE, E, x, mass properties, C_r; J after a frame at
// vertices where the case's own outputs have it).
// case.json: {"inputs": {u, tets, W, examples: [{name, t, q_xyzw}], dt, density, alpha, beta, gamma, lambda, mu, nu, Cr_star,
// frames: [{impulses: [{v, j}]}]}}, SI, in the body's axes.
// Errors: a missing file or field, another type or shape, a vertex out of range, a number beyond its limit, what
// validate(ExampleSet) rejects.
Result<Json> replay_example(const std::filesystem::path& case_json);

}  // namespace crumple::lab
