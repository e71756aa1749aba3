#pragma once

#include "server/authoring/triangle_bvh.h"

namespace crumple::authoring {

// Signed solid angle of a triangle seen from q [sr], positive where its front side faces away from q:
//   tan(Omega / 2) = det(a b c) / (|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)      [Van Oosterom & Strackee 1983]
// with a, b, c the corners relative to q. Zero for a degenerate triangle; on the triangle itself the sign is arbitrary.
double solid_angle(const Vec3& q, const std::array<Vec3, 3>& corners);

// Generalised winding number of a triangle surface [Jacobson, Kavan & Sorkine-Hornung 2013]:
//   w(q) = sum of signed solid angles / (4 pi)
// 1 inside and 0 outside of a closed outward surface, 2 where two parts overlap, and a smooth number in between around
// an open one: a point counts as inside where w > 1/2.
class WindingNumber {
 public:
  explicit WindingNumber(const sim::SurfaceMesh& surface);

  // By the tree: a cluster farther than kAccuracy of its radii acts as one dipole, its area-weighted normal at its
  // area-weighted centroid [Barill et al. 2018, section 3]. Differs from `exact` by
  // 3e-2 at worst.
  double operator()(const Vec3& q) const;
  bool inside(const Vec3& q) const { return (*this)(q) > 0.5; }

  // The plain sum over all triangles.
  double exact(const Vec3& q) const;

 private:
  static constexpr double kAccuracy = 2.5;  // Barill's beta

  struct Dipole {
    Vec3 centre;   // area-weighted centroid [m]
    Vec3 moment;   // sum of area-weighted normals / (4 pi) [m^2]
    double reach;  // squared distance beyond which the dipole stands for its triangles [m^2]
  };

  TriangleBvh tree_;
  std::vector<Dipole> dipoles_;  // one a tree node
};

}  // namespace crumple::authoring
