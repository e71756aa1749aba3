#pragma once

#include "server/sim/contact/detect.h"

#include <span>
#include <vector>

// Contact that goes on where it is not found. Detection looks for it where bodies would be at the end of the step without
// contact, x + dt (v + dt g), and without their own elasticity. Right after an impact two surfaces lie on each other with the
// same velocity, so that nothing overlaps there, and what the impact has squeezed drives them into each other: by 110 mm in one
// step, where cubes of 1 m have met at 6 m/s. A row that pushed in the last step and is not found in this one goes on, therefore,
// where it was on both bodies, for as long as it pushes, and for kLongest steps at most.
namespace crumple::sim::contact {

inline constexpr int kLongest = 4;  // two leave flickering contact, eight make a step of a pile of cubes a tenth dearer

// State, as what friction remembers is.
using LastingRows = std::vector<ContactRow>;

// Adds those rows of two finite-element bodies, or of one with itself, that pushed, by their outcome; of unknowns alone.
// soft_bodies: these are the first of detect()'s bodies.
void remember_pushing(std::span<const ContactRow> rows, int soft_bodies, LastingRows& memory);

// Adds to `rows`, which detect() found, those of memory whose tets they do not have: after them, as pairs of their own, with the gap
// that the last step left, or none. bodies: as in detect(). Left out is what has broken since, or has a node that is no longer an
// unknown. keys: scratch.
void append_lasting(const LastingRows& memory, std::span<const CollisionBody> bodies, double dt, std::vector<RowKey>& keys,
                    std::vector<ContactRow>& rows);

}  // namespace crumple::sim::contact
