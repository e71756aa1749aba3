#pragma once

#include "server/authoring/deformed_shape.h"
#include "server/sim/example_based/example_set.h"

namespace crumple::authoring {

// What an artist hands over: a surface, and as much of a rig as there is. V vertices, H handles.
struct ArtistMesh {
  sim::SurfaceMesh surface;
  std::vector<sim::example_based::Handle> handles;
  std::vector<int> parents;  // H: the handle that each hangs on, -1: none; or empty, where that is not known
  Eigen::MatrixXd weights;  // V x H: painted joint weights, rows sum to 1 or, where nothing is painted, 0; or empty
  std::vector<sim::example_based::Example> poses;  // of the handles, without the rest pose
  std::vector<DeformedShape> copies;
  std::vector<Vec3> colours;          // V: linear red, green, blue in [0, 1]; or empty
  std::vector<std::string> warnings;  // what a user should know
};

}  // namespace crumple::authoring
