#include "server/sim/contact/row_index.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace crumple::sim::contact {

void RowIndex::clear(int count) {
  slots_.assign(std::bit_ceil(static_cast<std::uint32_t>(std::max(1, 2 * count))), Slot{});
}

std::uint32_t RowIndex::first_slot(const RowKey& key) const {
  std::uint64_t mixed = 0;
  for (const int id : key) mixed = (mixed ^ static_cast<std::uint32_t>(id)) * 0x9e3779b97f4a7c15u;
  return static_cast<std::uint32_t>(mixed >> 32) & static_cast<std::uint32_t>(slots_.size() - 1);
}

void RowIndex::add(const RowKey& key, int position) {
  assert(position >= 0);
  for (std::size_t s = first_slot(key);; s = (s + 1) & (slots_.size() - 1)) {
    if (slots_[s].position >= 0 && slots_[s].key != key) continue;
    if (slots_[s].position < 0) slots_[s] = {key, position};
    return;
  }
}

int RowIndex::find(const RowKey& key) const {
  if (slots_.empty()) return -1;
  for (std::size_t s = first_slot(key); slots_[s].position >= 0; s = (s + 1) & (slots_.size() - 1))
    if (slots_[s].key == key) return slots_[s].position;
  return -1;
}

}  // namespace crumple::sim::contact
