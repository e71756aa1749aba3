#pragma once

#include "server/authoring/artist_mesh.h"
#include "server/io/gltf_nodes.h"
#include "server/io/rig_import.h"

namespace crumple::io {

// One skin of a file. Its mesh lies in the space it was bound in; IBM_j takes it into joint j's. In the scene joint j
// carries it by G_j IBM_j, G_j the product of nodes' transforms [glTF 2.0, section 3.7.3.3].
struct GltfSkin {
  std::vector<int> joints;                    // nodes
  std::vector<int> handle;                    // of each joint
  std::vector<Eigen::Affine3d> inverse_bind;  // IBM_j
  Eigen::Affine3d bind_to_scene;              // M: where the scene has the mesh at rest
};

struct GltfSkins {
  std::vector<GltfSkin> skins;
  std::vector<sim::example_based::Handle> handles;  // of all skins, each node once; at rest at M IBM^-1 0 in the scene
  std::vector<int> parents;                         // of each: the nearest joint above its node, -1: none
};

// M is G_j IBM_j where all joints agree on it, as they do where the file's nodes stand as they were bound. Where they
// stand in some pose, M is the identity if that only moves joints rigidly (Blender binds in the scene's axes), else the
// first joint's. Errors: a joint that is no node or is named twice, a number of inverse bind matrices other than of
// joints, one that cannot be inverted, above 1024 joints.
Result<GltfSkins> read_skins(const GltfDocument& document, const std::vector<Eigen::Affine3d>& world,
                             std::vector<std::string>& warnings);

// One key of a channel: the first of `width` numbers or, of `items` > 1 items a key, all of them side by side.
Result<Eigen::MatrixXd> first_key(const GltfDocument& document, const Json& animation, const Json& channel,
                                  const std::string& where, int width, int items);

// Each animation's first keys as a pose of the handles: T_j = G_j IBM_j M^-1.
Result<std::vector<sim::example_based::Example>> read_poses(const GltfDocument& document, const GltfSkins& skins,
                                                            const std::vector<GltfTransform>& local,
                                                            ScaledJoints scaled, std::vector<std::string>& warnings);

}  // namespace crumple::io
