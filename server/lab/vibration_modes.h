#pragma once

#include "server/lab/yardstick_case.h"

#include <vector>

namespace crumple::lab {

// The lowest `count` natural frequencies [Hz] of a level's mesh at rest, ascending, rigid modes as 0: K u = w^2 M u with
// lumped mass, supported dofs removed. Subspace iteration on (K + s M)^-1 M with a small shift s, which keeps the matrix
// positive definite where the mesh is free. Error: more modes asked for than free dofs.
Result<std::vector<double>> natural_frequencies(const Level& level, const Material& material, int count);

}  // namespace crumple::lab
