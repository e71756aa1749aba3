#include "server/sim/linear_solver/level_change.h"

#include <cassert>

namespace crumple::sim::linear_solver {
namespace {

int size_of(std::span<const int> row_start, int row) { return row_start[row + 1] - row_start[row]; }

// Coarse points are recognised by the fine ones that they move. One that would be two, or would stand in another order, is none.
std::vector<int> match_coarse(const LevelTransfer& before, const LevelTransfer& now, std::span<const int> fine_before) {
  constexpr int kUnknown = -2;
  std::vector<int> match(now.coarse_count(), kUnknown);
  for (int i = 0; i < now.fine_count(); ++i) {
    const int was = fine_before[i];
    if (was < 0 || size_of(now.row_start, i) != size_of(before.row_start, was)) continue;
    for (int k = 0; k < size_of(now.row_start, i); ++k) {
      int& m = match[now.coarse[now.row_start[i] + k]];
      const int other = before.coarse[before.row_start[was] + k];
      m = m == kUnknown || m == other ? other : -1;
    }
  }
  int last = -1;
  for (int& m : match) {
    if (m > last) last = m;
    else m = -1;
  }
  return match;
}

bool same_row(const LevelGraph& before, const LevelGraph& now, std::span<const int> fine_before, int i) {
  const int was = fine_before[i];
  if (was < 0 || size_of(now.row_start, i) != size_of(before.row_start, was)) return false;
  for (int k = 0; k < size_of(now.row_start, i); ++k)
    if (fine_before[now.columns[now.row_start[i] + k]] != before.columns[before.row_start[was] + k]) return false;
  return true;
}

bool same_transfer(const LevelTransfer& before, const LevelTransfer& now, const LevelChange& change, int i) {
  const int was = change.fine_before[i];
  if (was < 0 || size_of(now.row_start, i) != size_of(before.row_start, was)) return false;
  for (int k = 0; k < size_of(now.row_start, i); ++k) {
    const int at = now.row_start[i] + k, there = before.row_start[was] + k;
    if (change.coarse_before[now.coarse[at]] != before.coarse[there] || now.weight[at] != before.weight[there]) return false;
  }
  return true;
}

}  // namespace

std::vector<int> match_points(std::span<const Vec3> before, std::span<const Vec3> now) {
  std::vector<int> match(now.size(), -1);
  std::size_t at = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    while (at < before.size() && before[at] != now[i]) ++at;
    if (at == before.size()) break;
    match[i] = static_cast<int>(at++);
  }
  return match;
}

LevelChange level_change(const LevelView& before, const LevelView& now, std::vector<int> fine_before) {
  assert(static_cast<int>(fine_before.size()) == now.transfer.fine_count());
  LevelChange change;
  change.fine_before = std::move(fine_before);
  change.coarse_before = match_coarse(before.transfer, now.transfer, change.fine_before);
  change.coarse_after.assign(before.transfer.coarse_count(), -1);
  change.same.assign(now.transfer.coarse_count(), 0);
  for (int J = 0; J < now.transfer.coarse_count(); ++J) {
    const int was = change.coarse_before[J];
    if (was < 0) continue;
    change.coarse_after[was] = J;
    change.same[J] = size_of(now.transfer.column_start, J) == size_of(before.transfer.column_start, was);
  }
  const auto spoil = [&](int i) {
    for (int k = now.transfer.row_start[i]; k < now.transfer.row_start[i + 1]; ++k) change.same[now.transfer.coarse[k]] = 0;
  };
  for (int i = 0; i < now.transfer.fine_count(); ++i) {
    if (!same_row(before.fine, now.fine, change.fine_before, i)) spoil(i);
    if (same_transfer(before.transfer, now.transfer, change, i)) continue;
    spoil(i);
    for (int k = now.fine.row_start[i]; k < now.fine.row_start[i + 1]; ++k) spoil(now.fine.columns[k]);
  }
  return change;
}

}  // namespace crumple::sim::linear_solver
