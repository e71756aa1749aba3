#pragma once

#include "common/types.h"

#include <cmath>
#include <cstring>

#ifdef __AVX2__
#include <immintrin.h>
#endif

// Four doubles in the lanes of the vector unit.
namespace crumple::sim {

using Quad = double __attribute__((vector_size(32)));

inline Quad quad(double s) { return Quad{s, s, s, s}; }

inline Quad square_root(Quad v) {
#ifdef __AVX2__
  return _mm256_sqrt_pd(v);
#else
  return Quad{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}

// a b + c, rounded once where the machine can: the build contracts nothing by itself.
inline Quad multiply_add(Quad a, Quad b, Quad c) {
#ifdef __FMA__
  return _mm256_fmadd_pd(a, b, c);
#else
  return a * b + c;
#endif
}

// p[0] to p[3].
inline Quad load_four(const double* p) {
  Quad v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

inline Quad load_four(const float* p) {
#ifdef __AVX2__
  return _mm256_cvtps_pd(_mm_loadu_ps(p));  // one instruction, where g++ 12 makes four of a vector conversion
#else
  return Quad{p[0], p[1], p[2], p[3]};
#endif
}

// p[0], p[1], p[2], 0; nothing beyond them is read.
inline Quad load_three(const double* p) {
#ifdef __AVX2__
  return _mm256_maskload_pd(p, _mm256_set_epi64x(0, -1, -1, -1));
#else
  return Quad{p[0], p[1], p[2], 0};
#endif
}

// The first three numbers of each column.
inline Mat3 to_matrix(const Quad (&columns)[3]) {
  Mat3 m;
  for (int j = 0; j < 3; ++j) m.col(j) = Vec3(columns[j][0], columns[j][1], columns[j][2]);
  return m;
}

}  // namespace crumple::sim
