#include "server/sim/islands/stillness.h"

namespace crumple::sim::islands {

void observe(std::span<const Vec3> x, double dt, const StillnessBounds& bounds, Stillness& points) {
  if (points.before.size() != x.size()) {
    points = {};
    points.before.assign(x.begin(), x.end());
    points.middle = points.before;
    return;
  }
  const double way = dt * bounds.speed, reach = bounds.radius * bounds.radius;
  const double share = bounds.mean > dt ? dt / bounds.mean : 1;
  const bool rests = points.steps > 0;
  bool slow = true, near = true;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Vec3 halfway = 0.5 * (points.before[k] + x[k]);
    Vec3 middle = halfway;
    if (share < 1) middle = points.middle[k] + share * (halfway - points.middle[k]);
    slow = slow && (middle - points.middle[k]).squaredNorm() <= way * way && (x[k] - middle).squaredNorm() <= 4 * reach;
    if (!((halfway - middle).squaredNorm() <= 4 * reach)) middle = halfway;  // what stops does not lag behind for long
    if (rests) near = near && (middle - points.anchor[k]).squaredNorm() <= reach;
    points.before[k] = x[k];
    points.middle[k] = middle;
  }
  if (!slow) {
    points.steps = 0;
  } else if (rests && near) {
    ++points.steps;
  } else {
    points.anchor = points.middle;
    points.steps = 1;
  }
}

void Stillness::hash(StateHash& hash) const {
  hash.add(std::span<const Vec3>(before));
  hash.add(std::span<const Vec3>(middle));
  if (steps > 0) hash.add(std::span<const Vec3>(anchor));
  hash.add(static_cast<std::uint64_t>(steps));
}

}  // namespace crumple::sim::islands
