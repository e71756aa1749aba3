#pragma once

#include "common/error.h"
#include "common/types.h"

#include <vector>

namespace crumple::rig {

// The plate comes down, goes back up, and the body springs back [s].
inline constexpr double kPress = 0.75, kRelease = 0.25, kRest = 0.25;
inline constexpr double kWaveSpeed = 100;  // of sound, in sizes of the body a second: 75 pass while the plate comes down

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

  // What came out of the press, moved back over the rest shape (least squares). in_press: its points; rest: the same
  // before they were laid in. Errors: not finite.
  struct Released {
    std::vector<Vec3> x;
    double thickness;  // what is left of the extent along the push, as a part of it [-]
  };
  Result<Released> released(const std::vector<Vec3>& in_press, const std::vector<Vec3>& rest) const;
};

}  // namespace crumple::rig
