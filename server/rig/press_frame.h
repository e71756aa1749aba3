#pragma once

#include "common/types.h"

#include <vector>

namespace crumple::rig {

// A body as it lies in the press: the side that is pushed in faces up, the other one stands on y = 0, the middle of its
// box over the origin.
struct PressFrame {
  Quat up;
  Vec3 foot;            // of the turned body [m]
  double extent, size;  // along the push; the longest side [m]

  // side: the axis, and whether it is pushed from its largest coordinate.
  PressFrame(const std::vector<Vec3>& X, int axis, bool from_max);
  Vec3 in_press(const Vec3& X) const { return up * X - foot; }
  Vec3 from_press(const Vec3& x) const { return up.conjugate() * (x + foot); }
};

// R, t with R a_i + t closest to b_i by least squares (Kabsch).
Pose closest_motion(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace crumple::rig
