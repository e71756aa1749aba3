#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::authoring {

// Groups of points that are near each other (Euclidean), by k-means: `count` centres, the first the point farthest from
// their mean, each other the point farthest from those before, then at most `rounds` rounds of Lloyd's. Returns the
// group of each point, numbered in order of appearance; empty groups are dropped, so there may be fewer than `count`.
// points: one a column, at least one; coordinates of the size of 1, as weights are. count >= 1. Ties go to the earlier
// centre.
struct Clusters {
  int count = 0;
  std::vector<int> of;  // one a point, [0, count)
};
Clusters k_means(const Eigen::MatrixXd& points, int count, int rounds = 10);

}  // namespace crumple::authoring
