#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <limits>
#include <vector>

// Solids that are cut by planes, piece after piece.
namespace crumple::authoring {

// A solid by its flat faces. It need not be convex or in one part; what counts is that it is closed: for each edge
// a -> b of a loop there is an edge b -> a of another. That is all `clip` asks for, and what it keeps, so that rounding
// can make a face thin but never leave a hole.
struct Polyhedron {
  static constexpr int kOutside = -1;  // label of faces that nothing lies against
  struct Face {
    int label = kOutside;
    std::vector<std::vector<int>> loops;  // point ids: one counter-clockwise seen from outside, then holes, clockwise
  };
  std::vector<Vec3> points;
  std::vector<Face> faces;

  bool is_empty() const { return faces.empty(); }
};

// The solid inside a closed surface; vertices at exactly the same place are one. Its faces are kOutside. INVALID if
// the surface is open, does not run the same way round everywhere, or encloses no volume: the message says which.
Result<Polyhedron> polyhedron_of(const sim::SurfaceMesh& surface);
Polyhedron polyhedron_of(const Eigen::AlignedBox3d& box);

// The part where normal . p <= offset. What the plane cuts open is closed by a face with `label`.
Polyhedron clip(Polyhedron solid, const Vec3& normal, double offset, int label);

// Volume [m^3], by the divergence theorem over the loops.
double volume(const Polyhedron& solid);

Eigen::AlignedBox3d box_of(const Polyhedron& solid);

// The parts that have no point in common, cavities with what is around them.
std::vector<Polyhedron> parts(const Polyhedron& solid);

}  // namespace crumple::authoring
