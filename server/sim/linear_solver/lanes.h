#pragma once

#include <Eigen/Core>

#include <cstring>

#ifdef __AVX2__
#include <immintrin.h>
#endif

// Vectors and 3x3 blocks of a preconditioner in single precision: four floats to a node, the fourth carried along.
namespace crumple::sim::linear_solver {

using Lanes = float __attribute__((vector_size(16)));

inline Lanes lanes(float s) { return Lanes{s, s, s, s}; }

// Four numbers from p on; of the last column of a 3x3 block the fourth belongs to the next one.
inline Lanes load_lanes(const float* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

// a b + c, rounded once where the machine can: the build contracts nothing by itself.
inline Lanes multiply_add(Lanes a, Lanes b, Lanes c) {
#ifdef __FMA__
  return _mm_fmadd_ps(a, b, c);
#else
  return a * b + c;
#endif
}

// Eight numbers at once: nearly a 3x3 block.
using Octet = float __attribute__((vector_size(32)));

inline Octet octet(float s) { return Octet{s, s, s, s, s, s, s, s}; }

inline Octet load_octet(const float* p) {
  Octet v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

inline Octet multiply_add(Octet a, Octet b, Octet c) {
#ifdef __FMA__
  return _mm256_fmadd_ps(a, b, c);
#else
  return a * b + c;
#endif
}

// A 3x3 block by columns.
struct LaneBlock {
  Lanes column[3] = {Lanes{}, Lanes{}, Lanes{}};

  LaneBlock() = default;
  explicit LaneBlock(const Eigen::Matrix3d& m) {
    for (int j = 0; j < 3; ++j)
      column[j] = Lanes{static_cast<float>(m(0, j)), static_cast<float>(m(1, j)), static_cast<float>(m(2, j)), 0};
  }
};

// sum + B x.
inline Lanes multiply_add(const LaneBlock& B, Lanes x, Lanes sum) {
  return multiply_add(B.column[0], lanes(x[0]), multiply_add(B.column[1], lanes(x[1]), multiply_add(B.column[2], lanes(x[2]), sum)));
}

inline Lanes cross(Lanes a, Lanes b) {
  return Lanes{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace crumple::sim::linear_solver
