#pragma once

#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/pose_from_shape.h"
#include "server/sim/mesh/surface_mesh.h"

namespace crumple::authoring {

struct ShapeRigOptions {
  double tolerance = 0.05;  // of the largest relative residual of all shapes [-], (0, 1]
  int most_handles = 64;    // [1, kMaxBones]
  int first_handles = 4;    // placed where none are given (place_handles), [1, most_handles]
  BiharmonicOptions weights = {};
  double turn_penalty = 0;  // of pose_from_shape [-]
};

// One round of rig_from_shapes.
struct ShapeRigRound {
  int handles = 0;
  double relative = 0;  // largest relative residual (rms) of all shapes [-]
};

struct ShapeRig {
  Handles handles;  // given ones first, then those added
  Eigen::MatrixXd W;
  std::vector<FittedPose> poses;  // one a shape
  std::vector<ShapeRigRound> rounds;
  bool reached = false;  // the tolerance
};

// A rig that approximates given shapes of a surface, at its samples (surface_samples.h, a mean edge of the tets apart)
// (the first wish of Jones et al. 2016's future work; figure 5): handles are added until every shape is met to a
// tolerance. Each round solves the weights, fits all shapes, and adds handles where the residual is largest, at
// vertices of the tets' surface, a quarter more and not near each other. The best round is returned; `reached` is false
// where most_handles, or the vertices of the mesh, do not suffice. Errors: what bounded_biharmonic_weights and
// pose_from_shape reject, options out of range, no shape.
Result<ShapeRig> rig_from_shapes(const sim::TetMesh& mesh, const sim::SurfaceMesh& surface,
                                 const std::vector<DeformedShape>& shapes, const Handles& given,
                                 const ShapeRigOptions& options = {});

}  // namespace crumple::authoring
