#pragma once

#include <string>

namespace crumple::io {

// How glTF writes numbers (glTF 2.0, sections 3.6.2 and 3.11).
enum GltfComponentType { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

int size_of(int component_type);             // bytes; 0: no such type
int components_of(const std::string& type);  // of "VEC3": 3; 0: no type that is read

// The number at `at`. Normalised integers as fractions: "f = max(c / 127, -1)".
double component(const unsigned char* at, int component_type, bool normalised);

}  // namespace crumple::io
