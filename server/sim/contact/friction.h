#pragma once

#include "server/sim/contact/contact_rows.h"
#include "server/sim/contact/row_index.h"

#include <span>
#include <vector>

// Coulomb friction, |lambda_t| <= mu lambda_n, of rows that are solved in passes.
namespace crumple::sim::contact {

// Last step's tangential impulses: state, part of a snapshot. What held a contact in the last step is given in advance
// in this one, so that a body at rest on a slope needs no velocity to be held (without it: creep of mm/s).
struct FrictionMemory {
  struct Entry {
    RowKey key;
    Vec3 impulse;            // tangential, on side 0, at most mu lambda_n [N s]
    bool slid;
  };
  std::vector<Entry> entries;
  RowIndex index;              // into entries

  const Entry* find(const RowKey& key) const;  // as of the last make_index(); null: not there
  void make_index();                           // after entries have changed
};

// Before the first pass. u: the rows' relative velocity before the step. `active`: rows that push at u (all, if
// may_pull). A row that stuck in the last step, or is new and at rest, sticks: c_t = c_n, t0 = last step's impulse turned
// into the row's plane. One that slid, or is new and moves, slides.
void start_row(const FrictionMemory& memory, const Vec3& u, bool may_pull, ContactRow& row);

// After a pass, with the rows' u of that pass: for the next one sets `active` (rows that would pull let go, rows that let
// go and would push return) and the tangential law: a row sticks while |lambda_t| stays
// within mu lambda_n; else it slides under the damper c_t = mu lambda_n / |u_t| <= c_n, t0 = 0, which takes energy whatever
// happens. |u_t| is what the row's speed will be: that of this pass, corrected for the change of friction of its pair.
// True if the next pass would differ from this one. rows: whole pairs, consecutive.
bool refresh_rows(std::span<ContactRow> rows, std::span<const Vec3> u, bool may_pull);

// After the last pass: lambda_n and lambda_t of the row as it was solved.
void set_outcome(ContactRow& row, const Vec3& u);

// Adds the outcome of rows; after the last of them, make_index().
void remember_friction(std::span<const ContactRow> rows, FrictionMemory& memory);

}  // namespace crumple::sim::contact
