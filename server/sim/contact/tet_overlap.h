#pragma once

#include "common/types.h"

#include <array>
#include <cstdint>

// The polyhedron in which two tetrahedra, or a tetrahedron and a half-space, overlap: the geometry of contact
// [Parker & O'Brien 2009, section 6, after O'Brien 2000].
namespace crumple::sim::contact {

// A tetrahedron and the planes of its faces. Face k lies opposite node k; inverted tetrahedra are allowed: their
// normals point outwards, too.
struct OrientedTet {
  Mat34 x;                        // node positions [m], columns
  Eigen::Matrix<double, 4, 3> n;  // unit outward face normals, rows; face k is the plane n_k . p = offset_k
  Eigen::Vector4d offset;         // [m]
  Eigen::Vector4d height;         // of node k above face k [m], > 0
  bool inverted = false;
  double volume = 0;              // absolute [m^3]; 0 marks a flat tetrahedron: its planes are not to be used

  Vec3 normal(int face) const { return n.row(face).transpose(); }
};
OrientedTet orient(const Mat34& x);

// Weights of p, summing to 1; within [0, 1] inside. tet.volume > 0.
Eigen::Vector4d barycentric(const OrientedTet& tet, const Vec3& p);

struct TetOverlap {
  double volume = 0;  // [m^3]; 0: no overlap, the rest is unset
  Vec3 centroid = Vec3::Zero();
  // Outward area vectors [m^2] of the parts of the eight faces that bound the overlap: 0..3 the first tet's face
  // opposite node k, 4..7 the second's. They sum to zero.
  std::array<Vec3, 8> face_area{};
  // Corners of those parts of faces, each once for every one it belongs to: the first corner_count are set.
  std::array<Vec3, 64> corners;
  int corner_count = 0;
};
// Both volumes > 0.
TetOverlap overlap(const OrientedTet& a, const OrientedTet& b);

struct ContactNormal {
  Vec3 r;             // direction in which the first tet is pushed, times the contact's area (without the weight) [m^2]
  bool from_surface;  // false: no face of the surface bounds the overlap, or only at its rim: r is a fallback
  double weight = 1;  // [0, 1]: next to nothing where the surface has little more than a share of the rim
};
// Area-weighted normals of the faces contributed by one of the two, here only of faces in the exterior masks (bit k: the
// face opposite node k belongs to the body's surface). Swapping the two gives -r.
ContactNormal contact_normal(const TetOverlap& overlap, const OrientedTet& a, const OrientedTet& b,
                             std::uint8_t exterior_a, std::uint8_t exterior_b);

struct HalfSpaceOverlap {
  double volume = 0;  // of the part below the plane [m^3]; 0: none, the rest is unset
  Vec3 centroid = Vec3::Zero();
  double area = 0;    // of the plane's cut through the tet [m^2]; 0 if all of the tet lies below
};
// The part of `tet` where normal . p < offset; |normal| = 1.
HalfSpaceOverlap overlap(const OrientedTet& tet, const Vec3& normal, double offset);

// min(V/A, V^(1/3)) [m]: exact for a slab; the second bound keeps thin side-to-side slivers, whose A vanishes faster
// than V, from claiming any depth they like.
double overlap_depth(double volume, double area);

}  // namespace crumple::sim::contact
