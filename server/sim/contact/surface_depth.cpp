#include "server/sim/contact/surface_depth.h"

#include <algorithm>
#include <limits>

namespace crumple::sim::contact {
namespace {

constexpr double kMinCosine = 0.8;
constexpr double kMaxOverMean = 1.5;

// Of the overlap's corners below face k.
double deepest_below(const TetOverlap& overlap, const OrientedTet& tet, int k) {
  double depth = 0;
  for (int i = 0; i < overlap.corner_count; ++i) depth = std::max(depth, tet.offset[k] - tet.n.row(k).dot(overlap.corners[i]));
  return depth;
}

// out: the way out of `tet`.
double least_way_out(const TetOverlap& overlap, const BoundaryTet& tet, const Vec3& out) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    const double facing = tet.shape.n.row(k).dot(out);
    if ((tet.exterior >> k & 1) && facing > kMinCosine) least = std::min(least, deepest_below(overlap, tet.shape, k) / facing);
  }
  return least;
}

}  // namespace

double surface_depth(const TetOverlap& overlap, double area, const Vec3& normal, const BoundaryTet& a, const BoundaryTet& b) {
  const double mean = overlap_depth(overlap.volume, area);
  const double way = std::min(least_way_out(overlap, a, -normal), least_way_out(overlap, b, normal));
  return way < std::numeric_limits<double>::infinity() ? std::min(way, kMaxOverMean * mean) : mean;
}

}  // namespace crumple::sim::contact
