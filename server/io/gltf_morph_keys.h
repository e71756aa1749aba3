#pragma once

#include "server/authoring/artist_mesh.h"
#include "server/io/gltf_document.h"

namespace crumple::io {

// Adds what animations make of morph targets by the weights that they key first: a copy an animation. mesh: with its
// copies, one a morph target. Errors: a channel's node, mesh, sampler or key that is not there.
Result<void> add_morphed_copies(const GltfDocument& document, authoring::ArtistMesh& mesh);

}  // namespace crumple::io
