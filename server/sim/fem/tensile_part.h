#pragma once

#include "server/sim/fem/lane_matrix.h"

namespace crumple::sim::fem {

// sigma+ = sum_i max(0, s_i) n_i n_i^T over the eigenpairs (s_i, n_i) of a symmetric sigma [Pa]; sigma- is the rest. To 1e-14 of
// |sigma| where that is in 1e-150 to 1e150; what is smaller may be lost, what is larger may give NaN, as what is not finite does. Of
// four at once, which have the bits that each has by itself.
QuadMatrix tensile_parts(const QuadMatrix& sigma);
Mat3 tensile_part(const Mat3& sigma);

}  // namespace crumple::sim::fem
