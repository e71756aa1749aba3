#pragma once

#include <chrono>

namespace crumple::lab {

// The clock that benchmarks read [ms].
inline double now_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace crumple::lab
