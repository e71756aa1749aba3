#include "server/sim/motion.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim {

Pose pose_at(std::span<const PoseKey> keys, double time) {
  assert(!keys.empty());
  const auto next = std::upper_bound(keys.begin(), keys.end(), time, [](double t, const PoseKey& key) { return t < key.time; });
  if (next == keys.begin()) return keys.front().pose;
  if (next == keys.end()) return keys.back().pose;
  const PoseKey& from = *(next - 1);
  const double s = (time - from.time) / (next->time - from.time);
  return {from.pose.R_WB.slerp(s, next->pose.R_WB), (1 - s) * from.pose.p_WB + s * next->pose.p_WB};
}

Vec3 angular_velocity_between(const Quat& R_from, const Quat& R_to, double dt) {
  Quat turn = R_to * R_from.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const Eigen::AngleAxisd rotation(turn.normalized());
  return rotation.axis() * (rotation.angle() / dt);
}

}  // namespace crumple::sim
