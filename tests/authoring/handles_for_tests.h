#pragma once

#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/shapes/box_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

// What tests of handles and their weights begin with.
namespace crumple::authoring {

inline Handles points(const std::vector<Vec3>& at) {
  Handles out;
  for (const Vec3& p : at) out.handles.push_back(Handle::point(p));
  return out;
}

inline sim::TetMesh bar(int cells, double thickness) {
  return *box_mesh({.size = {1, thickness, thickness}, .cells = {cells, 1, 1}, .minimum = Vec3::Zero()});
}

inline BiharmonicWeights solve(const sim::TetMesh& mesh, const Handles& handles, const BiharmonicOptions& options = {}) {
  auto out = bounded_biharmonic_weights(mesh, handles, options);
  EXPECT_TRUE(out) << out.error().text();
  return out ? std::move(*out) : BiharmonicWeights{};
}

// How far the rows of W are from the simplex.
inline double outside_simplex(const Eigen::MatrixXd& W) {
  return std::max({-W.minCoeff(), W.maxCoeff() - 1, (W.rowwise().sum().array() - 1).abs().maxCoeff()});
}

}  // namespace crumple::authoring
