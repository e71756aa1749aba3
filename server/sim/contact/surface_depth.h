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
// their overlap [m]: the least over the faces of either that look within 37 degrees of it. But half more than
// overlap_depth(V, area) at most, and that where no face looks so.
//
// V/A alone is a third of the depth where a corner has come through a face, half where an edge has, and all of it in a slab: bodies
// stopped by it stop in each other. In a pile of 64 cubes of 1 m that stood 16 mm deep at rest, vertices are 10 mm deep by this, over
// 20 mm for 0.7 s instead of 1.2 after impact, and a step is solved in 15 % less; the deepest impact is 106 mm instead of 81. Whole, not
// bounded by half more, cubes that stand on each other creep: rows push at the overlap's centroid, and by the deepest of its corners all
// of a face jumps.
double surface_depth(const TetOverlap& overlap, double area, const Vec3& normal, const BoundaryTet& a, const BoundaryTet& b);

}  // namespace crumple::sim::contact
