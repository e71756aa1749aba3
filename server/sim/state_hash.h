#pragma once

#include "common/types.h"

#include <bit>
#include <cstdint>
#include <span>

namespace crumple::sim {

// 64 bits over the bit patterns of what it is fed, in order; -0 and 0 differ, as they may in the next step.
class StateHash {
 public:
  void add(std::uint64_t word) {
    // One round of a multiply-xorshift mixer a word (constants of MurmurHash3's finaliser).
    hash_ ^= word + 0x9e3779b97f4a7c15ULL + (hash_ << 6) + (hash_ >> 2);
    hash_ ^= hash_ >> 33;
    hash_ *= 0xff51afd7ed558ccdULL;
    hash_ ^= hash_ >> 33;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const Vec3& v) { for (double c : v) add(c); }
  void add(const Quat& q) { for (double c : q.coeffs()) add(c); }
  void add(const Mat3& m) { for (double c : m.reshaped()) add(c); }
  template <class T>
  void add(std::span<const T> values) { for (const T& value : values) add(value); }

  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0x6a09e667f3bcc908ULL;
};

}  // namespace crumple::sim
