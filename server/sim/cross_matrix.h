#pragma once

#include "common/types.h"

namespace crumple::sim {

// C of C b = a x b.
inline Mat3 cross_matrix(const Vec3& a) {
  Mat3 C;
  C << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return C;
}

}  // namespace crumple::sim
