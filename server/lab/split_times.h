#pragma once

#include "server/lab/yardstick_case.h"

#include <array>

namespace crumple::lab {

struct SplitTimesOptions {
  std::array<int, 3> cells{25, 4, 4};  // of a block of the Kuhn lattice, each in [2, 100]
  int splits = 200;                    // [1, 10000]
};

// How long the coarse levels of multigrid take to come up to date after one node of a block has split, a random one each time:
// medians of processor time over all splits.
//   {"nodes", "tets", "levels": before the first split, "splits",
//    "followed_us": with what is far from the split taken over, "anew_us": made anew,
//    "values_us": of either: the operators' values, which every step computes}
// Both have the same bits: tested, and compared here.
// Errors: options out of range.
Result<Json> time_splits(const SplitTimesOptions& options);

}  // namespace crumple::lab
