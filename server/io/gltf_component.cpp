#include "server/io/gltf_component.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace crumple::io {
namespace {

template <class T>
T raw(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);  // the format is little-endian, as the machines that we build for
  return value;
}

}  // namespace

int size_of(int component_type) {
  switch (component_type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

double component(const unsigned char* at, int type, bool normalised) {
  switch (type) {
    case kByte:
      return normalised ? std::max(raw<std::int8_t>(at) / 127.0, -1.0) : raw<std::int8_t>(at);
    case kUnsignedByte:
      return *at / (normalised ? 255.0 : 1.0);
    case kShort:
      return normalised ? std::max(raw<std::int16_t>(at) / 32767.0, -1.0) : raw<std::int16_t>(at);
    case kUnsignedShort:
      return raw<std::uint16_t>(at) / (normalised ? 65535.0 : 1.0);
    case kUnsignedInt:
      return raw<std::uint32_t>(at);
    default:
      return raw<float>(at);
  }
}

int components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  return type == "MAT4" ? 16 : 0;
}

}  // namespace crumple::io
