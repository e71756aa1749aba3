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
using Mask = decltype(Quad{} < Quad{});  // of each lane all ones or none

inline bool any(Mask mask) {
#ifdef __AVX2__
  return _mm256_movemask_pd(reinterpret_cast<__m256d>(mask)) != 0;
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}
inline bool all(Mask mask) { return !any(~mask); }
inline bool all(bool one) { return one; }

inline Quad quad(double s) { return Quad{s, s, s, s}; }

inline Quad square_root(Quad v) {
#ifdef __AVX2__
  return _mm256_sqrt_pd(v);
#else
  return Quad{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}

inline double square_root(double s) { return std::sqrt(s); }

// a b + c, rounded once where the machine can: the build contracts nothing by itself.
inline double multiply_add(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(a, b, c);
#else
  return a * b + c;
#endif
}
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

inline Quad load_three(const float* p) {
#ifdef __AVX2__
  return _mm256_cvtps_pd(_mm_maskload_ps(p, _mm_set_epi32(0, -1, -1, -1)));
#else
  return Quad{p[0], p[1], p[2], 0};
#endif
}

inline void store_three(Quad v, double* p) {
#ifdef __AVX2__
  _mm256_maskstore_pd(p, _mm256_set_epi64x(0, -1, -1, -1), v);
#else
  for (int i = 0; i < 3; ++i) p[i] = v[i];
#endif
}

inline void store_three(Quad v, float* p) {
#ifdef __AVX2__
  _mm_maskstore_ps(p, _mm_set_epi32(0, -1, -1, -1), _mm256_cvtpd_ps(v));
#else
  for (int i = 0; i < 3; ++i) p[i] = static_cast<float>(v[i]);
#endif
}

// In every lane.
inline Quad sum_of_lanes(Quad v) {
  v += __builtin_shufflevector(v, v, 1, 0, 3, 2);
  return v + __builtin_shufflevector(v, v, 2, 3, 0, 1);
}

// Rows to columns.
inline void transpose(Quad& a, Quad& b, Quad& c, Quad& d) {
  const Quad ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Quad cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

// Four rows of N numbers, one after another: to[k] has the k-th of each, and back.
template <int N>
[[gnu::always_inline]] inline void load_rows(const double* p, Quad* to) {
  for (int k = 0; k + 4 <= N; k += 4) {
    for (int lane = 0; lane < 4; ++lane) to[k + lane] = load_four(p + N * lane + k);
    transpose(to[k], to[k + 1], to[k + 2], to[k + 3]);
  }
  for (int k = N - N % 4; k < N; ++k) to[k] = Quad{p[k], p[N + k], p[2 * N + k], p[3 * N + k]};
}
template <int N>
[[gnu::always_inline]] inline void store_rows(const Quad* from, double* p) {
  for (int k = 0; k + 4 <= N; k += 4) {
    Quad four[4] = {from[k], from[k + 1], from[k + 2], from[k + 3]};
    transpose(four[0], four[1], four[2], four[3]);
    for (int lane = 0; lane < 4; ++lane) std::memcpy(p + N * lane + k, &four[lane], sizeof four[lane]);
  }
  for (int k = N - N % 4; k < N; ++k)
    for (int lane = 0; lane < 4; ++lane) p[N * lane + k] = from[k][lane];
}

// x, y and z of four vectors.
inline void load_vectors(const double* a, const double* b, const double* c, const double* d, Quad (&to)[3]) {
  Quad row[4] = {load_three(a), load_three(b), load_three(c), load_three(d)};
  transpose(row[0], row[1], row[2], row[3]);
  for (int i = 0; i < 3; ++i) to[i] = row[i];
}

// The first three numbers of each column.
inline Mat3 to_matrix(const Quad (&columns)[3]) {
  Mat3 m;
  for (int j = 0; j < 3; ++j) m.col(j) = Vec3(columns[j][0], columns[j][1], columns[j][2]);
  return m;
}

}  // namespace crumple::sim
