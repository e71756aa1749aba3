#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

// Differences as bytes that compress well: modulo 2^bits, of either sign as a small number (0 -1 1 -2 ... -> 0 1 2 3 ...), and
// of all numbers the lowest byte, then of all the next: of small numbers the higher bytes are nearly all zero.
namespace crumple {

template <class U>
U zigzag(U difference) {
  static_assert(std::is_unsigned_v<U>);
  const bool negative = difference >> (8 * sizeof(U) - 1);
  return static_cast<U>(static_cast<U>(difference << 1) ^ (negative ? static_cast<U>(-1) : U{0}));
}

template <class U>
U unzigzag(U number) {
  static_assert(std::is_unsigned_v<U>);
  return static_cast<U>(static_cast<U>(number >> 1) ^ (number & 1 ? static_cast<U>(-1) : U{0}));
}

template <class U>
void append_planes(std::string& bytes, const std::vector<U>& differences) {
  const std::size_t begin = bytes.size(), count = differences.size();
  bytes.resize(begin + sizeof(U) * count);
  for (std::size_t i = 0; i < count; ++i) {
    const U number = zigzag(differences[i]);
    for (std::size_t k = 0; k < sizeof(U); ++k) bytes[begin + k * count + i] = static_cast<char>(number >> (8 * k) & 0xff);
  }
}

// planes: sizeof(U) * count bytes.
template <class U>
std::vector<U> differences_of(const char* planes, std::size_t count) {
  std::vector<U> differences(count);
  for (std::size_t i = 0; i < count; ++i) {
    U number = 0;
    for (std::size_t k = 0; k < sizeof(U); ++k)
      number = static_cast<U>(number | static_cast<U>(static_cast<std::uint8_t>(planes[k * count + i])) << (8 * k));
    differences[i] = unzigzag(number);
  }
  return differences;
}

}  // namespace crumple
