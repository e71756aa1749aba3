#include "server/sim/contact/friction.h"

#include <algorithm>

namespace crumple::sim::contact {
namespace {

std::array<int, 4> key_of(const ContactRow& row) {
  return {row.sides[0].body, row.sides[1].body, row.sides[0].tet, row.sides[1].tet};
}

Vec3 tangential(const ContactRow& row, const Vec3& u) { return u - row.normal.dot(u) * row.normal; }

bool by_key(const FrictionMemory::Entry& a, const FrictionMemory::Entry& b) { return a.key < b.key; }

}  // namespace

void carry_friction(const FrictionMemory& memory, std::span<ContactRow> rows) {
  for (ContactRow& row : rows) {
    row.active = true;
    row.t0.setZero();
    row.c_t = row.friction > 0 ? row.c_n : 0;
    if (row.friction <= 0) continue;
    const FrictionMemory::Entry wanted{key_of(row), Vec3::Zero()};
    const auto found = std::lower_bound(memory.entries.begin(), memory.entries.end(), wanted, by_key);
    if (found != memory.entries.end() && found->key == wanted.key) row.t0 = tangential(row, found->impulse);
  }
}

void set_outcome(ContactRow& row, const Vec3& u) {
  row.lambda_n = row.active ? row.c_n * (row.target - row.normal.dot(u)) : 0;
  row.lambda_t = row.active ? Vec3(row.t0 - row.c_t * tangential(row, u)) : Vec3(Vec3::Zero());
}

bool refresh_friction(ContactRow& row, const Vec3& u, bool may_pull) {
  set_outcome(row, u);
  const double would_be = row.c_n * (row.target - row.normal.dot(u));
  const bool active = may_pull || would_be > 0;
  const bool switched = active != row.active;
  row.active = active;
  if (row.friction <= 0 || !active) return switched;

  // Why the sliding force is given and not, as a damper c_t = mu lambda_n / |u_t|, implicit in the next pass: |u_t| of
  // this pass is that of a row held by c_t = c_n, next to nothing, and the iteration c_t -> |u_t| -> c_t gains 15 % a
  // step: a block on a 30 degree slope took half a second to let go. The given force cannot turn the motion round:
  // it is less than the one, found in this pass, that stops it.
  // A row that slid in this pass is judged by what it would take to stop it now.
  const Vec3 sticking = row.c_t > 0 ? row.lambda_t : Vec3(row.t0 - row.c_n * tangential(row, u));
  const double bound = row.friction * std::max(would_be, 0.0), size = sticking.norm();
  if (size <= bound) {
    const bool changed = row.c_t == 0;
    row.c_t = row.c_n;
    return switched || changed;
  }
  const Vec3 t0 = bound / size * sticking;
  const bool changed = row.c_t > 0 || (t0 - row.t0).norm() > 1e-3 * bound;
  row.c_t = 0;
  row.t0 = t0;
  return switched || changed;
}

void remember_friction(std::span<const ContactRow> rows, FrictionMemory& memory) {
  for (const ContactRow& row : rows)
    if (row.active && row.friction > 0) memory.entries.push_back({key_of(row), row.lambda_t});
}

void sort(FrictionMemory& memory) { std::sort(memory.entries.begin(), memory.entries.end(), by_key); }

}  // namespace crumple::sim::contact
