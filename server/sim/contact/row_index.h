#pragma once

#include "server/sim/contact/contact_rows.h"

#include <cstdint>
#include <vector>

namespace crumple::sim::contact {

// Where a row of these two tets stands in a list: a hash table that keeps its memory from step to step.
class RowIndex {
 public:
  // Of these alone: items[k], whose key is key_of(items[k]), stands at k. Of two equal keys the first one does.
  template <class Items, class KeyOf>
  void assign(const Items& items, KeyOf key_of) {
    clear(static_cast<int>(items.size()));
    for (int k = 0; k < static_cast<int>(items.size()); ++k) add(key_of(items[k]), k);
  }
  int find(const RowKey& key) const;  // -1: not there

 private:
  struct Slot {
    RowKey key;
    int position = -1;  // free
  };
  void clear(int count);  // for so many keys to come
  void add(const RowKey& key, int position);
  std::uint32_t first_slot(const RowKey& key) const;

  std::vector<Slot> slots_;  // a power of two of them, at least twice the keys
};

}  // namespace crumple::sim::contact
