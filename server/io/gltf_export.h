#pragma once

#include "server/sim/example_based/example_set.h"

#include <string>
#include <vector>

namespace crumple::io {

// A rig as the bytes of a .glb (glTF 2.0), for modelling programs; import_artist_mesh reads it back.
//   the render surface, or the tets' own where there is none, with the eight largest weights of each vertex (those of
//   its tet's nodes, interpolated; JOINTS_0 and _1); a joint a handle, unturned at rest; each example but the rest pose
//   as an animation of one key; scales of alpha and beta as COLOR_0 (authoring/painted_regions.h).
// Tets, convex parts and small weights are not in it. `notes` gets what was lost: weight left out, scales out of range.
// Errors: a set without a triangle; above 65,535 bones cannot be.
Result<std::string> gltf_of(const sim::example_based::ExampleSet& set, std::vector<std::string>& notes);

}  // namespace crumple::io
