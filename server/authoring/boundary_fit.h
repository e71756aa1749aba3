#pragma once

#include "server/authoring/enclosing_mesh.h"

namespace crumple::authoring {

// Draws the boundary of an enclosing mesh onto the surface it was made for, so that a body that collides by its nodes
// touches where it is drawn. Boundary tets of little solid that lean on fuller ones go, unless the mesh would fall into
// more parts; then boundary nodes move to the nearest point of the surface, and the nodes nearest to the surface's
// extreme points (26 directions, each connected part) onto these, as far as every tet keeps a twenty-fifth of its
// volume. Fill is sampled anew. The mesh no longer encloses the surface; vertices left outside lie near some tet.
sim::TetMesh fitted_to_surface(const EnclosingMesh& enclosing, const sim::SurfaceMesh& surface);

// The nodes on the mesh's own surface, ascending, without those that still stick out of the solid by more than
// `reach` [m]: what a body should collide by.
std::vector<int> nodes_at_solid(const sim::TetMesh& mesh, const sim::SurfaceMesh& surface, double reach);

}  // namespace crumple::authoring
