#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

namespace crumple {

// How far each vertex is from its body's natural state, [0, 1]: its values (BodyFrame::values, channel after channel)
// summed over the channels. Without values nothing.
inline std::vector<float> sum_of_channels(std::span<const float> values, std::size_t vertices) {
  assert(vertices > 0 ? values.size() % vertices == 0 : values.empty());
  std::vector<float> sums(values.empty() ? 0 : vertices, 0.0f);
  for (std::size_t i = 0; i < values.size(); ++i) sums[i % vertices] += values[i];
  return sums;
}

}  // namespace crumple
