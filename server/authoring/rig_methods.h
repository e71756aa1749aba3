#pragma once

#include "server/authoring/artist_mesh.h"

#include <functional>
#include <optional>
#include <span>

namespace crumple::authoring {

// Where some of a rig's handles go; the others follow. H entries.
using PartialPose = std::vector<std::optional<sim::example_based::BoneTransform>>;

// The mathematics of algorithm 1 (Jones et al. 2016, section 4), as the pipeline calls it. N vertices, H handles.
struct RigMethods {
  // W: N x H, in [0, 1], rows sum to 1.
  std::function<Result<Eigen::MatrixXd>(const sim::TetMesh& mesh, std::span<const Vec3> handles)> weights;

  // `count` points of the mesh's surface nodes to put handles beside those `given` [m].
  std::function<std::vector<Vec3>(const sim::TetMesh& mesh, const std::vector<int>& surface,
                                  std::span<const Vec3> given, int count)>
      place;

  // The pose whose skin is closest to where the field puts the nodes.
  std::function<sim::example_based::Example(const std::string& name, const sim::example_based::ExampleSet& set,
                                            std::span<const Vec3> handles,
                                            const std::function<Vec3(const Vec3&)>& field)>
      fit;

  // What the handles do that a pose does not name.
  std::function<std::vector<sim::example_based::BoneTransform>(const sim::example_based::ExampleSet& set,
                                                               std::span<const Vec3> handles, const PartialPose& pose)>
      complete;
};

// weights: handle_weights. place: place_handles of so many more, of which those nearest to given ones go. fit:
// fit_example with and without rotations, whichever leaves less. complete: each other handle is carried by those that
// the pose names, by handle_weights of them, QLERP of their rotations and the blend of where they put it.
RigMethods default_rig_methods();

// x_i = sum_b W_ib T_b u_i [Jones et al. 2016, eq. 1] for all vertices [m].
std::vector<Vec3> skinned(const sim::example_based::ExampleSet& set,
                          const std::vector<sim::example_based::BoneTransform>& T);

}  // namespace crumple::authoring
