#pragma once

#include <span>
#include <vector>

namespace crumple::sim {

// Leaves the entries at `kept`, ascending, in their order. An array without entries stays so.
template <class T>
void keep(std::vector<T>& values, std::span<const int> kept) {
  if (values.empty()) return;
  for (std::size_t i = 0; i < kept.size(); ++i) values[i] = values[kept[i]];
  values.resize(kept.size());
}

}  // namespace crumple::sim
