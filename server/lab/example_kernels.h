#pragma once

#include "server/lab/yardstick_case.h"

namespace crumple::lab {

struct ExampleKernelOptions {
  double cell_size = 0.158;  // of the generated car's lattice [m], [0.08, 1]; 0.158: 4,727 vertices
  int threads = 1;
  int repeats = 201;         // [1, 100000]
};

// How long the parts of example-based deformation take on the generated car, alone, medians over `repeats`:
//   {"vertices", "tets", "handles", "examples",
//    "skinning_us": eq. 3 of all vertices, their example weights anywhere in the simplex,
//    "impulse_us": {gamma [m]: {"vertices_reached", "projection": eqs. 4, 5, 8, "propagation": eqs. 11, 12,
//                   "both", "both_first_time": with the geodesic distances from a place that was not struck before}}}
// Errors: options out of range, make_car_asset's.
Result<Json> time_example_kernels(const ExampleKernelOptions& options);

}  // namespace crumple::lab
