#pragma once

#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <span>
#include <vector>

namespace crumple::authoring {

// Where a handle goes: x = R (u - pivot) + s, with s where its pivot goes [m].
struct HandleMotion {
  Mat3 R = Mat3::Identity();
  Vec3 s = Vec3::Zero();
};

// Linear blend skinning [Jones et al. 2016, eq. 1] of points carried by a skinned tet mesh, as a linear function of the
// handles' motions:
//   x_v = sum_b R_b Y_vb + w_vb s_b,    w_vb = sum_k c_k W_kb,    Y_vb = sum_k c_k W_kb (u_k - pivot_b)
// over the corners k of the tet that carries v, with barycentric coordinates c_k. Pivots are chosen so that the terms
// of one handle are independent, sum_v w_vb Y_vb = 0: a rotation does not ask for a translation.
class EmbeddedSkinning {
 public:
  struct Term {
    int handle;
    double w;  // [-]
    Vec3 Y;    // [m]
  };

  // mesh must be valid, W: N x B. Points: those of a surface at rest, or the mesh's own vertices.
  EmbeddedSkinning(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, std::span<const Vec3> points);
  EmbeddedSkinning(const sim::TetMesh& mesh, const Eigen::MatrixXd& W);

  int point_count() const { return static_cast<int>(start_.size()) - 1; }
  int handle_count() const { return static_cast<int>(pivots_.size()); }
  std::span<const Term> terms(int v) const { return std::span(terms_).subspan(start_[v], start_[v + 1] - start_[v]); }
  const Vec3& pivot(int b) const { return pivots_[b]; }

  std::vector<HandleMotion> rest() const;  // no motion
  Vec3 position(int v, std::span<const HandleMotion> motions) const;

 private:
  void choose_pivots();

  std::vector<int> start_;   // point_count + 1, into terms_
  std::vector<Term> terms_;  // those with a weight that is not zero
  std::vector<Vec3> pivots_;
};

}  // namespace crumple::authoring
