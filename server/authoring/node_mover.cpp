#include "server/authoring/node_mover.h"

#include <algorithm>

namespace crumple::authoring {

void NodeMover::move(int node, const Vec3& target) {
  const Vec3 from = mesh_.X[node];
  for (const double part : {1.0, 0.75, 0.5, 0.25})
    if (try_move(node, from + part * (target - from))) return;
}

bool NodeMover::try_move(int node, const Vec3& target) {
  const Vec3 from = mesh_.X[node];
  mesh_.X[node] = target;
  if (allowed(node)) return true;
  mesh_.X[node] = from;
  return false;
}

bool NodeMover::allowed(int node) const {
  const auto star = stars_[node];
  return std::all_of(star.begin(), star.end(), [&](int t) { return sim::signed_volume(mesh_, t) >= least_; });
}

}  // namespace crumple::authoring
