#pragma once

#include "server/sim/quad.h"

// 3x3 matrices of several elements at once, one in each lane of the vector unit, or of one: S is Quad or double. Lanes do
// not see each other.
namespace crumple::sim::fem {

// By columns.
template <class S>
struct LaneMatrix {
  S m[9];

  S& operator()(int i, int j) { return m[3 * j + i]; }
  S operator()(int i, int j) const { return m[3 * j + i]; }
};

using QuadMatrix = LaneMatrix<Quad>;

// Four matrices in a row.
inline QuadMatrix load(const Mat3* four) {
  QuadMatrix a;
  load_rows<9>(four->data(), a.m);
  return a;
}
inline void store(const QuadMatrix& a, Mat3* four) {
  store_rows<9>(a.m, four->data());
}

template <class S>
LaneMatrix<S> product(const LaneMatrix<S>& a, const LaneMatrix<S>& b) {
  LaneMatrix<S> c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      c(i, j) = multiply_add(a(i, 2), b(2, j), multiply_add(a(i, 1), b(1, j), a(i, 0) * b(0, j)));
  return c;
}

// a^T b
template <class S>
LaneMatrix<S> transposed_product(const LaneMatrix<S>& a, const LaneMatrix<S>& b) {
  LaneMatrix<S> c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      c(i, j) = multiply_add(a(2, i), b(2, j), multiply_add(a(1, i), b(1, j), a(0, i) * b(0, j)));
  return c;
}

// a b^T
template <class S>
LaneMatrix<S> product_transposed(const LaneMatrix<S>& a, const LaneMatrix<S>& b) {
  LaneMatrix<S> c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      c(i, j) = multiply_add(a(i, 2), b(j, 2), multiply_add(a(i, 1), b(j, 1), a(i, 0) * b(j, 0)));
  return c;
}

// det a a^-T: the cross products of a's columns.
template <class S>
LaneMatrix<S> cofactors(const LaneMatrix<S>& a) {
  LaneMatrix<S> c;
  for (int j = 0; j < 3; ++j) {
    const int p = (j + 1) % 3, q = (j + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      const int r = (i + 1) % 3, s = (i + 2) % 3;
      c(i, j) = a(r, p) * a(s, q) - a(s, p) * a(r, q);
    }
  }
  return c;
}

template <class S>
S squared_norm(const LaneMatrix<S>& a) {
  S sum = a.m[0] * a.m[0];
  for (int k = 1; k < 9; ++k) sum = multiply_add(a.m[k], a.m[k], sum);
  return sum;
}

template <class S>
S first_column_dot(const LaneMatrix<S>& a, const LaneMatrix<S>& b) {
  return multiply_add(a(2, 0), b(2, 0), multiply_add(a(1, 0), b(1, 0), a(0, 0) * b(0, 0)));
}

}  // namespace crumple::sim::fem
