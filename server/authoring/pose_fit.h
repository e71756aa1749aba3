#pragma once

#include "server/authoring/pose_field.h"
#include "server/sim/example_based/example_set.h"

#include <span>
#include <string>

namespace crumple::authoring {

// The rest pose: every bone the identity.
sim::example_based::Example rest_example(int bones);

enum class BoneRotations { none, follow_field };

// The pose of the bones that skins the vertices u [m] closest to where a field puts them. Rotations: none, or at each
// bone the rotation part of the field's gradient there (central differences, polar decomposition). Then the
// translations t minimise
//   sum_i | sum_b W_ib (R_b u_i + t_b) - (u_i + field(u_i)) |^2 + ridge sum_b | t_b - t_b0 |^2,
// t_b0 = p_b + field(p_b) - R_b p_b moving the bone's own point p_b with the field; the ridge (1e-2 of the mean
// diagonal of W^T W) keeps bones that hardly act near it.
// W: N x B, bones: B points [m].
sim::example_based::Example fit_example(std::string name, const Eigen::MatrixXd& W, std::span<const Vec3> u,
                                        std::span<const Vec3> bones, const PoseField& field,
                                        BoneRotations rotations = BoneRotations::none);

// x_i = sum_b W_ib T_b u_i [Jones et al. 2016, eq. 1] for all vertices of the set [m].
std::vector<Vec3> skinned(const sim::example_based::ExampleSet& set,
                          const std::vector<sim::example_based::BoneTransform>& T);

}  // namespace crumple::authoring
