#pragma once

#include "server/authoring/enclosing_mesh.h"

namespace crumple::authoring {

// Draws the boundary of an enclosing mesh onto the surface it was made for, so that a body that collides by its nodes
// touches where it is drawn. Boundary tets of little solid that lean on fuller ones go, unless the mesh would fall into
// more parts; then boundary nodes move to the nearest point of the surface, and the nodes nearest to the surface's
// extreme points (26 directions, each connected part) onto these, as far as every tet keeps a twenty-fifth of its
// volume. Fill is sampled anew. The mesh no longer encloses the surface; vertices left outside lie near some tet
// (pushed_around_vertices).
sim::TetMesh fitted_to_surface(const EnclosingMesh& enclosing, const sim::SurfaceMesh& surface);

// Pushes the boundary of such a mesh outwards again, where vertices of the surface stick out of it, until it encloses
// them: each asks the three nodes of the face nearest to it for the smallest moves that reach it and a thousandth of a
// cell more. Where tets are in the way, nodes behind go half of it, in every second sweep those of the boundary too.
// Tets keep a twenty-fifth of a lattice tet's volume, after 20 sweeps a tenth of that. Fill is sampled anew. What is
// much thinner than a cell may still leave vertices outside after 60 sweeps (outside_vertices).
sim::TetMesh pushed_around_vertices(sim::TetMesh mesh, const sim::SurfaceMesh& surface, double cell_size);

// Those that lie in no tet (barycentric coordinates below -1e-6), ascending.
std::vector<int> outside_vertices(const sim::TetMesh& mesh, const std::vector<Vec3>& vertices);

// The nodes on the mesh's own surface, ascending, without those that still stick out of the solid by more than
// `reach` [m]: what a body should collide by.
std::vector<int> nodes_at_solid(const sim::TetMesh& mesh, const sim::SurfaceMesh& surface, double reach);

}  // namespace crumple::authoring
