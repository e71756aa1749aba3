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

// A copy of those entries alone.
template <class T>
std::vector<T> taken(const std::vector<T>& values, std::span<const int> kept) {
  std::vector<T> part;
  if (values.empty()) return part;
  part.reserve(kept.size());
  for (const int i : kept) part.push_back(values[i]);
  return part;
}

}  // namespace crumple::sim
