#pragma once

#include "server/sim/contact/contact_rows.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::contact {

// Where a row of these two tets stands in a list: a hash table that keeps its memory from step to step.
class RowIndex {
 public:
  // Empties it, for `count` keys to come.
  void clear(int count);
  // Of two equal keys the first stays. At most so many as clear() was told.
  void add(const RowKey& key, int position);
  int find(const RowKey& key) const;  // -1: not there

 private:
  struct Slot {
    RowKey key;
    int position = -1;  // free
  };
  std::uint32_t first_slot(const RowKey& key) const;

  std::vector<Slot> slots_;  // a power of two of them, at least twice the keys
};

}  // namespace crumple::sim::contact
