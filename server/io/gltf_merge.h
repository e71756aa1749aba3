#pragma once

#include "server/authoring/artist_mesh.h"
#include "server/io/gltf_primitive.h"

namespace crumple::io {

// From vertices as the file has them to those of a surface: those in one place, moved alike by every morph target, are
// one; their colours and weights are averaged. Triangles without area go, and vertices that no triangle has. Fills
// surface, colours, weights and copies. handles: how many the mesh has.
void merge_vertices(const GltfVertices& vertices, int handles, authoring::ArtistMesh& mesh);

}  // namespace crumple::io
