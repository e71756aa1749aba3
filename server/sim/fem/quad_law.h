#pragma once

#include "server/sim/fem/corotational.h"
#include "server/sim/fem/fem_material.h"
#include "server/sim/quad.h"

// The co-rotated law of four elements at once, one in each lane of the vector unit. Lanes do not see each other.
namespace crumple::sim::fem {

using Mask = long long __attribute__((vector_size(32)));

inline bool any(Mask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

// A 3x3 matrix of each of four tets, by columns.
struct QuadMatrix {
  Quad m[9];

  Quad& operator()(int i, int j) { return m[3 * j + i]; }
  Quad operator()(int i, int j) const { return m[3 * j + i]; }
};

inline QuadMatrix product(const QuadMatrix& a, const QuadMatrix& b) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) c(i, j) = a(i, 0) * b(0, j) + a(i, 1) * b(1, j) + a(i, 2) * b(2, j);
  return c;
}

// a^T b
inline QuadMatrix transposed_product(const QuadMatrix& a, const QuadMatrix& b) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) c(i, j) = a(0, i) * b(0, j) + a(1, i) * b(1, j) + a(2, i) * b(2, j);
  return c;
}

// det a a^-T: the cross products of a's columns.
inline QuadMatrix cofactors(const QuadMatrix& a) {
  QuadMatrix c;
  for (int j = 0; j < 3; ++j) {
    const int p = (j + 1) % 3, q = (j + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      const int r = (i + 1) % 3, s = (i + 2) % 3;
      c(i, j) = a(r, p) * a(s, q) - a(s, p) * a(r, q);
    }
  }
  return c;
}

inline Quad squared_norm(const QuadMatrix& a) {
  Quad sum = a.m[0] * a.m[0];
  for (int k = 1; k < 9; ++k) sum += a.m[k] * a.m[k];
  return sum;
}

inline Quad first_column_dot(const QuadMatrix& a, const QuadMatrix& b) { return a(0, 0) * b(0, 0) + a(1, 0) * b(1, 0) + a(2, 0) * b(2, 0); }

template <class Array>
QuadMatrix load(const Array& per_tet, int t) {
  QuadMatrix a;
  const double* p[4] = {per_tet[t].data(), per_tet[t + 1].data(), per_tet[t + 2].data(), per_tet[t + 3].data()};
  for (int k = 0; k < 9; ++k) a.m[k] = Quad{p[0][k], p[1][k], p[2][k], p[3][k]};
  return a;
}

inline void store(const QuadMatrix& a, int lane, double* to) {
  for (int k = 0; k < 9; ++k) to[k] = a.m[k][lane];
}

// From four deformation gradients to rotations and stresses.
class QuadLaw {
 public:
  void set_material(int lane, const FemMaterial& material, const Lame& lame, const Mat3& plastic_strain);
  // False, and nothing of use done, if a lane needs a path of its own: QR, or F too near to singular for Newton's iteration.
  bool update(const QuadMatrix& F, const QuadMatrix& plastic_strain);

  QuadMatrix Q, sigma;  // as Elements has them
  QuadMatrix stress;    // sigma and what balances the moment of the forces (moment_balance)

 private:
  Quad lambda_, mu_;
  Mask qr_{}, balanced_{};
};

}  // namespace crumple::sim::fem
