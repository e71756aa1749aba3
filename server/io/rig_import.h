#pragma once

#include "server/authoring/artist_mesh.h"

#include <filesystem>

namespace crumple::io {

// What to do with a joint that an animation scales or shears: a bone can only turn and move (BoneTransform is rigid).
enum class ScaledJoints {
  reject,    // an error that names animation and joint
  turn_only  // its nearest rotation, about the joint, and a warning
};

// Reads what an artist made. Of glTF 2 (.gltf, .glb):
//   surface    all triangles where the scene's nodes put them; those of a skin as they were bound; equal positions
//              merged, but for vertices that a morph target parts
//   handles    joints of all skins, by their nodes' names; at rest where inverse bind matrices have them; parents as the
//              nodes hang together
//   weights    JOINTS_n and WEIGHTS_n for all n, normalised
//   poses      each animation's first keys, joints without a channel as their nodes stand: what Blender exports of an
//              action. About the file's origin: x = R u + t. One in which no joint moves is left out, with a warning
//   copies     morph targets by their names (extras.targetNames, else "morph 0" ...), of all meshes that have one so
//              named; and animations that key morph weights
//   colours    COLOR_0, as linear values (authoring/painted_regions.h says what they may mean)
// Every other format (import_surface) gives its surface and its vertices' colours alone. Units are the file's.
// Errors name file, place and rule: import_surface's and those of every field that is read; a joint or a weight that is
// not there; inverse bind matrices that cannot be inverted; above 1024 joints; scaled joints, see above.
Result<authoring::ArtistMesh> import_artist_mesh(const std::filesystem::path& file,
                                                 ScaledJoints scaled = ScaledJoints::reject);

}  // namespace crumple::io
