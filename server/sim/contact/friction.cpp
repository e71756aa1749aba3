#include "server/sim/contact/friction.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::contact {
namespace {

constexpr double kTouching = 1e-6;  // [m/s]: bodies placed exactly on each other push from the first pass on

Vec3 tangential(const ContactRow& row, const Vec3& u) { return u - row.normal.dot(u) * row.normal; }

}  // namespace

const FrictionMemory::Entry* FrictionMemory::find(const RowKey& key) const {
  const int position = index.find(key);
  return position < 0 ? nullptr : &entries[position];
}

void FrictionMemory::make_index() {
  index.assign(entries, [](const Entry& entry) { return entry.key; });
}

void start_row(const FrictionMemory& memory, const Vec3& u, bool may_pull, ContactRow& row) {
  // Not all rows: those that are still apart would pull in the first pass, and the others, from which friction is then
  // bounded, push twice as hard.
  const double approach = row.target - row.normal.dot(u);
  row.active = may_pull || approach > -kTouching;
  row.t0.setZero();
  row.c_t = 0;
  if (row.friction <= 0) return;
  const FrictionMemory::Entry* known = memory.find(row.key());
  const double speed = tangential(row, u).norm();
  if (known && known->slid) {
    row.c_t = std::min(row.c_n, known->impulse.norm() / std::max(speed, 1e-300));
  } else if (known) {
    row.c_t = row.c_n;
    row.t0 = tangential(row, known->impulse);
  } else if (speed <= row.friction * std::max(approach, 0.0)) {
    row.c_t = row.c_n;
  }
}

void set_outcome(ContactRow& row, const Vec3& u) {
  row.lambda_n = row.active ? row.c_n * (row.target - row.normal.dot(u)) : 0;
  row.lambda_t = row.active ? Vec3(row.t0 - row.c_t * tangential(row, u)) : Vec3(Vec3::Zero());
}

namespace {

// mu lambda_n, lambda_n the row's part of what its pair pressed in the pass, where pulling rows take from pushing ones.
double cone(const ContactRow& row) { return row.friction * row.lambda_n; }

void share_normal_impulse(std::span<ContactRow> rows) {
  double sum = 0, pushing = 0;
  for (const ContactRow& row : rows) {
    sum += row.lambda_n;
    pushing += std::max(row.lambda_n, 0.0);
  }
  for (ContactRow& row : rows) row.lambda_n = sum > 0 ? sum / pushing * std::max(row.lambda_n, 0.0) : 0;
}

bool sticks(const ContactRow& row) { return row.active && row.friction > 0 && row.c_t == row.c_n; }

// Sliding, or about to.
bool slides(const ContactRow& row) {
  return row.active && row.friction > 0 && (row.c_t < row.c_n || row.lambda_t.norm() > cone(row));
}

// Where a pair as a whole can hold what it holds, a row beyond its own cone does not let go: it goes on holding what it
// may, and the others take the rest in the next pass. (If it did let go, a block would creep by 0.7 mm/s on a slope of
// 26 degrees with mu = 0.5.)
bool yield_to_others(std::span<ContactRow> rows) {
  double held = 0, bound = 0;
  for (const ContactRow& row : rows) {
    if (!sticks(row)) continue;
    held += row.lambda_t.norm();
    bound += cone(row);
  }
  if (held > bound) return false;
  bool yields = false;
  for (ContactRow& row : rows) {
    const double own = row.lambda_t.norm();
    if (!sticks(row) || own <= cone(row)) continue;
    row.t0 = cone(row) / own * row.lambda_t;
    row.lambda_t = row.t0;  // no longer beyond its cone
    yields = true;
  }
  return yields;
}

// The rows of one pair of components.
bool refresh_sliding(std::span<ContactRow> rows, std::span<const Vec3> u) {
  share_normal_impulse(rows);
  // The speed of a row that has just let go is next to nothing, since c_t = c_n held it: c_t = mu lambda_n / |u_t| would
  // hold it again, and a block on a 30 degree slope would take half a second to get going. What the pair's sliding rows
  // held too much goes into motion of their share of its mass. (Row by row this correction would oscillate: the rows
  // of a stiff body move together.) The share is an estimate, hence the second bound on the speed.
  bool differs = yield_to_others(rows);
  double excess = 0, mass = 0;
  for (const ContactRow& row : rows) {
    if (!slides(row)) continue;
    excess += row.lambda_t.norm() - cone(row);
    mass += row.mass;
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    ContactRow& row = rows[k];
    if (!slides(row)) continue;
    const double speed = tangential(row, u[k]).norm(), before = row.c_t;
    const double sliding_speed = std::max(speed + excess / mass, 0.5 * speed);
    row.c_t = std::min(row.c_n, cone(row) / std::max(sliding_speed, 1e-300));
    row.t0.setZero();
    differs |= before == row.c_n || std::abs(row.c_t - before) > 1e-3 * before;
  }
  return differs;
}

}  // namespace

bool refresh_rows(std::span<ContactRow> rows, std::span<const Vec3> u, bool may_pull) {
  bool differs = false;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    set_outcome(rows[k], u[k]);
    const bool was_active = rows[k].active;
    rows[k].active = may_pull || rows[k].target > rows[k].normal.dot(u[k]);
    differs |= rows[k].active != was_active;
  }
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin + 1;
    while (end < rows.size() && rows[end].pair == rows[begin].pair) ++end;
    differs |= refresh_sliding(rows.subspan(begin, end - begin), u.subspan(begin, end - begin));
    begin = end;
  }
  return differs;
}

void remember_friction(std::span<const ContactRow> rows, FrictionMemory& memory) {
  for (const ContactRow& row : rows) {
    if (!row.active || row.friction <= 0 || row.swept) continue;
    const double bound = row.friction * std::max(row.lambda_n, 0.0), held = row.lambda_t.norm();
    memory.entries.push_back({row.key(), std::min(1.0, bound / std::max(held, 1e-300)) * row.lambda_t, row.c_t < row.c_n});
  }
}

}  // namespace crumple::sim::contact
