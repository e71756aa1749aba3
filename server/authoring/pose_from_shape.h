#pragma once

#include "common/error.h"
#include "server/authoring/deformed_shape.h"
#include "server/authoring/embedded_skinning.h"
#include "server/sim/example_based/example_set.h"

#include <algorithm>
#include <string>

namespace crumple::authoring {

// How far a pose is from the shape it was fitted to.
struct PoseResidual {
  double rms = 0;               // root mean square distance over the vertices [m]
  double max = 0;               // [m]
  int worst_vertex = 0;         // where the distance is `max`
  double displacement_rms = 0;  // of the shape from rest [m]
  double displacement_max = 0;  // [m]
  int sweeps = 0;               // alternating
  int steps = 0;                // Levenberg-Marquardt's, taken
  bool converged = false;       // the last step changed the energy by less than 1e-12 of it

  // Relative to the displacement; 0 where nothing is left over, also of a shape at rest.
  double relative() const { return rms > 0 ? rms / std::max(displacement_rms, 1e-300) : 0; }
};

struct FittedPose {
  sim::example_based::Example example;
  PoseResidual residual;
  std::vector<Vec3> left_over;  // shape - skinned, one a vertex [m]
};

// The pose of the handles that brings a surface closest to a deformed copy of it:
//   minimise  sum_v | sum_b R_b Y_vb + w_vb s_b - y_v |^2    over rotations R_b and translations s_b
// (EmbeddedSkinning: the surface is carried by the tets, as it is drawn). First sweeps over the handles: each in turn
// takes its best rotation and translation at once, the others fixed (orthogonal Procrustes: the polar factor of sum_v
// Y_vb r_vb^T, r what the others leave over), then all translations together by a linear solve. Then damped
// Gauss-Newton (Levenberg-Marquardt) on all motions. No sweep and no step raises the energy. Translations that the
// surface does not feel keep what they had. turn_penalty p >= 0 [-] adds p sum_b |R_b - 1|^2 sum_v |Y_vb|^2: a handle
// that the surface hardly feels may else turn far for next to nothing, and what it carries goes far astray between rest
// and pose, where the path is no straight line. rest: the surface at rest. Errors: another number of vertices than at
// rest, vertices that are not finite.
Result<FittedPose> pose_from_shape(const EmbeddedSkinning& skinning, std::span<const Vec3> rest,
                                   const DeformedShape& shape, const std::string& field = "shape",
                                   double turn_penalty = 0);

}  // namespace crumple::authoring
