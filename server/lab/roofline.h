#pragma once

#include "server/lab/yardstick_case.h"

#include <array>

namespace crumple::lab {

struct RooflineOptions {
  std::array<int, 3> cells{50, 10, 10};  // of beam A of docs/lab.md (benchmark_scenes.h); [1, 200] each
  std::vector<int> threads{1, 2};      // each in [1, 256]; at most 16 of them
  double stream_mb = 256;              // of each of the three arrays of the triad [MB], [1, 4096]
  int repeats = 21;                    // [1, 10000]
};

// How much of a machine's memory bandwidth the solver's hot loops use [Williams, Waterman, Patterson 2009: where loops do few
// operations a byte, bandwidth is the roof].
//   {"tets", "nodes", "stream_mb", "loops": [{"loop", "threads", "bytes", "us", "gb_per_s", "share", "fits"}]}
// The roof, for each number of threads, is that of `triad`, a_i = b_i + s c_i over arrays of stream_mb [McCalpin 1995], three
// numbers of traffic an entry, the one written counted once. `bytes` are what a call cannot do without: every array that one of its
// passes reads or writes, once, whatever is gathered from it again in the same pass. `share` is over the
// triad's bandwidth with as many threads; it passes 1 where all that a loop touches (`fits` [MB]) lies in a cache. Times are
// medians.
//   matvec, matvec_float: A x of the step's system, blocks in double or float
//   assembly: a whole StepSystem from positions and velocities
//   block_jacobi: z = D^-1 r
//   cg_vectors: an iteration of conjugate gradients around a diagonal matrix: all that one does besides matvec and block_jacobi
// Errors: options out of range, beam_scene's.
Result<Json> measure_roofline(const RooflineOptions& options);

// The result as a table of fixed columns.
std::string roofline_table(const Json& result);

}  // namespace crumple::lab
