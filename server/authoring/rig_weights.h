#pragma once

#include "server/authoring/handles.h"

namespace crumple::authoring {

// How a rig's weights are made of its handles.
//   gaussian            of the distance to each point (handle_weights.h): no time at all, whatever the shape; of a bone
//                       and of a cage the points alone count
//   bounded_biharmonic  of the shape (bounded_biharmonic_weights.h): they do not leak across gaps. 0.13 s to 0.16 s for
//                       1,000 to 1,600 vertices and 18 to 32 handles.
enum class RigWeights { gaussian, bounded_biharmonic };

struct RigWeighing {
  Eigen::MatrixXd W;                  // N x B, in [0, 1], rows sum to 1
  std::vector<std::string> warnings;  // what a user should know
};

// reach: how far outside the mesh a handle may lie and still act, on what is nearest to it [m]; 0: the mean length of
// the mesh's edges (bounded_biharmonic alone looks at it). Errors: bounded_biharmonic_weights'.
Result<RigWeighing> rig_weights(const sim::TetMesh& mesh, const Handles& handles, RigWeights kind, double reach = 0);

}  // namespace crumple::authoring
