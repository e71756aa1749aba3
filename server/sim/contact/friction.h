#pragma once

#include "server/sim/contact/contact_rows.h"

#include <array>
#include <span>
#include <vector>

// Coulomb friction, |lambda_t| <= mu lambda_n, of rows that are solved in passes.
namespace crumple::sim::contact {

// Last step's tangential impulses: state, part of a snapshot. What held a contact in the last step is given in advance
// in this one, so that a body at rest on a slope needs no velocity to be held (without it: creep of mm/s).
struct FrictionMemory {
  struct Entry {
    std::array<int, 4> key;  // bodies and tets of the two sides
    Vec3 impulse;            // tangential, on side 0 [N s]
  };
  std::vector<Entry> entries;  // ascending by key
};

// Before the first pass: t0 from the last step, turned into the row's plane; c_t = c_n: every row may stick.
void carry_friction(const FrictionMemory& memory, std::span<ContactRow> rows);

// After a pass, with the row's u of that pass: sets lambda_n and lambda_t, and for the next pass `active` (rows that
// would pull let go, rows that let go and would push return) and the tangential law: a row whose sticking impulse stays
// in the cone sticks, the others slide: c_t = 0, t0 = mu lambda_n against the motion.
// True if the next pass would differ from this one.
bool refresh_friction(ContactRow& row, const Vec3& u, bool may_pull);

// After the last pass: lambda_n and lambda_t of the row as it was solved.
void set_outcome(ContactRow& row, const Vec3& u);

// Adds the outcome of rows; after the last of them, sort().
void remember_friction(std::span<const ContactRow> rows, FrictionMemory& memory);
void sort(FrictionMemory& memory);

}  // namespace crumple::sim::contact
