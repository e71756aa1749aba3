#pragma once

#include "server/sim/rigid/rigid_world.h"

#include <vector>

namespace crumple::sim {

// The load of a joint as a mean over the last `time` seconds, or over one step if that is longer.
//
// A rigid solver gives a blow as an impulse J within one step. What force it was depends on how long it took, which a rigid
// body does not know: J / dt makes a joint half as strong where the step is half as long. Over a time T that is given, a blow
// loads a joint by J / T at any dt below T, and a load that lasts by what it is. Of T the part before the first step is without
// load. Up to kSteps steps are kept one by one; where T is longer, neighbours are kept as sums.
class LoadWindow {
 public:
  static constexpr int kSteps = 64;

  // dt, time: [s], dt > 0.
  LoadWindow(double dt, double time);

  void add(const JointLoad& step);
  Vec3 force() const { return mean(&JointLoad::impulse); }   // [N]
  Vec3 moment() const { return mean(&JointLoad::couple); }   // [N m]

  const std::vector<JointLoad>& kept() const { return kept_; }  // state, with `at`
  int at() const { return newest_ * bucket_ + filled_; }

 private:
  Vec3 mean(Vec3 JointLoad::*part) const;

  double time_;                  // [s]
  double span_;                  // of it, in entries
  int bucket_;                   // steps an entry
  int newest_ = 0, filled_ = 0;  // entry, and steps in it so far
  std::vector<JointLoad> kept_;  // a ring
};

}  // namespace crumple::sim
