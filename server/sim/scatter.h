#pragma once

#include <cstdint>

namespace crumple::sim {

// splitmix64's finaliser: a bijection that scatters its bits.
inline std::uint64_t scatter(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

// The upper bits of a word as a number in [0, 1).
inline double unit_interval(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

// Bodies break in different orders, and their pieces too.
inline std::uint64_t body_seed(std::uint64_t seed, std::uint32_t body) { return seed ^ (0x9e3779b97f4a7c15ULL * (body + 1)); }
inline std::uint64_t piece_seed(std::uint64_t seed, std::uint32_t body, int piece) {
  return body_seed(seed, body) ^ (piece == 0 ? 0 : scatter(static_cast<std::uint64_t>(piece)));
}

}  // namespace crumple::sim
