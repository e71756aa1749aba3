#pragma once

#include "server/sim/contact/detect.h"
#include "server/sim/contact/row_index.h"
#include "server/sim/state_hash.h"

#include <span>
#include <vector>

// Contact that goes on where it is not found. Detection looks for it where bodies would be at the end of the step without
// contact, and without their own elasticity. Right after an impact two surfaces lie on each other with the same velocity, so that
// nothing overlaps there, and what the impact has squeezed drives them into each other: by 110 mm in one step, where cubes of 1 m
// have met at 6 m/s. A row that pushed in the last step and is not found in this one goes on, therefore, between the same two
// points, for as long as it pushes and these have not slid apart by more than it is wide, and for kLastingSteps at most.
namespace crumple::sim::contact {

inline constexpr int kLastingSteps = 4;  // two leave contact that comes and goes; without a bound a pile of cubes takes a tenth longer

// State, as what friction remembers is.
struct LastingRows {
  std::vector<ContactRow> rows;

  void hash(StateHash& hash) const;
};

// Adds those rows of two finite-element bodies, or of one with itself, that pushed in a step of dt [s], by their outcome; of unknowns
// alone. Their depth is that at its end. soft_bodies: these are the first of detect()'s bodies.
void remember_pushing(std::span<const ContactRow> rows, int soft_bodies, double dt, LastingRows& memory);

// Adds to `rows`, which detect() found for a step of dt [s], those of memory whose tets they do not have: after them, as pairs of
// their own, with the gap that the last step left, or none. bodies: as in detect(). Left out is what has broken since, or has a node
// that is no longer an unknown. found: scratch.
void append_lasting(const LastingRows& memory, std::span<const CollisionBody> bodies, double dt, RowIndex& found,
                    std::vector<ContactRow>& rows);

}  // namespace crumple::sim::contact
