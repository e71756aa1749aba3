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
  struct Face {
    int label = 0;
    std::vector<std::vector<int>> loops;  // point ids; counter-clockwise seen from outside, holes clockwise
  };
  std::vector<Vec3> points;
  std::vector<Face> faces;

  bool is_empty() const { return faces.empty(); }
};

// The solid inside a closed surface; vertices at the same place are one. Its faces have the label given. INVALID if the
// surface is open: the message names how many edges have no other side.
Result<Polyhedron> polyhedron_of(const sim::SurfaceMesh& surface, int label);
Polyhedron polyhedron_of(const Eigen::AlignedBox3d& box, int label);

// The part where normal . p <= offset. What the plane cuts open is closed by a face with `label`.
Polyhedron clip(Polyhedron solid, const Vec3& normal, double offset, int label);

// Volume [m^3], by the divergence theorem over the loops.
double volume(const Polyhedron& solid);

// The parts that have no point in common.
std::vector<Polyhedron> parts(const Polyhedron& solid);

}  // namespace crumple::authoring
