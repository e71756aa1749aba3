#pragma once

#include "server/sim/linear_solver/simultaneous_solve.h"

namespace crumple::authoring {

// Moves every row to the nearest point (Euclidean) of the simplex: entries >= 0 that sum to 1.
void project_rows_to_simplex(sim::linear_solver::RowMatrix& rows);

}  // namespace crumple::authoring
