#pragma once

#include "server/sim/contact/tet_overlap.h"

#include <cstdint>

// How deep two tets of different bodies are in each other, by the surfaces they belong to.
namespace crumple::sim::contact {

struct BoundaryTet {
  const OrientedTet& shape;
  std::uint8_t exterior;  // bit k: the face opposite node k belongs to the surface
};

// The way along `normal` (unit, in which `a` is pushed) by which one of the tets comes out of a face of the other's surface with all of
// their overlap [m]: the least over the planes of either's faces that look along it, by 0.8 in cosine. At most 1.5 times
// overlap_depth(V, area); may be less than it; equal to it where no face looks so.
//
// V/A alone is a third of the depth where a corner has come through a face, half where an edge has, and all of it in a slab: bodies
// stopped by it stop in each other. Unbounded, cubes that stand on each other creep: rows push at the overlap's centroid, and by the
// deepest of its corners all of a face jumps. docs/lab.md has the numbers.
double surface_depth(const TetOverlap& overlap, double area, const Vec3& normal, const BoundaryTet& a, const BoundaryTet& b);

}  // namespace crumple::sim::contact
