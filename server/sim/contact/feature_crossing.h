#pragma once

#include "common/types.h"

#include <array>

// When a node crosses a triangle, or an edge an edge, while all of their points move straight on from p to p + d in a step
// (roots of a cubic in time; Parker & O'Brien 2009, section 6, take sub-steps instead).
namespace crumple::sim::contact {

// Times in [from, 1], ascending, at which the four points p_k + t d_k lie in a plane. Points that stay in one have none.
struct CoplanarTimes {
  std::array<double, 3> t{};
  int count = 0;
};
CoplanarTimes coplanar_times(const Mat34& p, const Mat34& d, double from);

struct FeatureCrossing {
  double t = 0;             // part of the step
  Eigen::Vector4d weights;  // of the four points where they meet; of each feature they sum to one
  Vec3 normal;              // unit; of the triangle, or across both edges: of no particular sense
  Vec3 relative;            // d of the first feature's point less that of the second's [m]
};

// At most three, ascending in t.
struct FeatureCrossings {
  std::array<FeatureCrossing, 3> at;
  int count = 0;
};

// Columns: the node, then the triangle's corners; the normal is theirs, counter-clockwise.
FeatureCrossings node_through_triangle(const Mat34& p, const Mat34& d, double from);
// Columns: the ends of one edge, then of the other.
FeatureCrossings edge_through_edge(const Mat34& p, const Mat34& d, double from);

}  // namespace crumple::sim::contact
