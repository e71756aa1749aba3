#pragma once

#include "common/types.h"
#include "server/sim/state_hash.h"

#include <span>
#include <vector>

// Whether a body is at rest: all its nodes slower than a threshold for several steps [Parker & O'Brien 2009, section 4].
// A speed alone would freeze what moves slowly for long (a block that slides at 3 mm/s), so nodes must also stay near where
// they were when they came to rest. Both are looked at half-way between the ends of two steps: contact can leave nodes that
// go up in one step and down in the next, by a millimetre; such a node is at rest, whatever its speed in each of them. What
// does not vibrate freely may be given a mean over a longer time, so that sinking for eight steps and being put back in one is rest, too.
namespace crumple::sim::islands {

struct StillnessBounds {
  double speed = 0;   // [m/s]
  double radius = 0;  // [m] how far a point may be from its place at the beginning of the rest; half of what it may
                      // go up and down by turns about that
  double mean = 0;    // [s]: places are means over about so long; 0: half-way alone
};

// What the points of one body did of late; state.
struct Stillness {
  std::vector<Vec3> before;  // at the end of the last step [m]
  std::vector<Vec3> middle;  // between the ends of the last two, or in the mean
  std::vector<Vec3> anchor;  // `middle` when the rest began
  int steps = 0;             // of rest, in a row

  void hash(StateHash& hash) const;
};

// x: the points at the end of a step of dt [s]. Their number may change (fracture): the rest then begins anew.
void observe(std::span<const Vec3> x, double dt, const StillnessBounds& bounds, Stillness& points);

}  // namespace crumple::sim::islands
