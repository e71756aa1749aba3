#include "server/authoring/pose_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include <cassert>

namespace crumple::authoring {
namespace {

Quat local_rotation(const PoseField& field, const Vec3& p, double step) {
  Mat3 F = Mat3::Identity();
  for (int k = 0; k < 3; ++k) {
    const Vec3 d = step * Vec3::Unit(k);
    F.col(k) += (field(p + d) - field(p - d)) / (2 * step);
  }
  const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return Quat(Mat3(svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose()));
}

}  // namespace

sim::example_based::Example rest_example(int bones) {
  return {"rest", std::vector<sim::example_based::BoneTransform>(bones)};
}

sim::example_based::Example fit_example(std::string name, const Eigen::MatrixXd& W, std::span<const Vec3> u,
                                        std::span<const Vec3> bones, const PoseField& field, BoneRotations rotations) {
  const int N = static_cast<int>(u.size()), B = static_cast<int>(bones.size());
  assert(W.rows() == N && W.cols() == B);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : u) box.extend(p);
  const double step = 0.02 * box.diagonal().norm();  // of the size of a dent, not of a wrinkle

  std::vector<Quat> R(B, Quat::Identity());
  Eigen::MatrixX3d t0(B, 3);
  for (int b = 0; b < B; ++b) {
    if (rotations == BoneRotations::follow_field) R[b] = local_rotation(field, bones[b], step);
    t0.row(b) = bones[b] + field(bones[b]) - R[b] * bones[b];
  }
  Eigen::MatrixX3d rest_of(N, 3);  // what the rotations and t0 leave over
  for (int i = 0; i < N; ++i) {
    Vec3 skinned = Vec3::Zero();
    for (int b = 0; b < B; ++b) skinned += W(i, b) * (R[b] * u[i] + t0.row(b).transpose());
    rest_of.row(i) = u[i] + field(u[i]) - skinned;
  }
  Eigen::MatrixXd A = W.transpose() * W;
  A.diagonal().array() += 1e-2 * A.trace() / B;
  const Eigen::MatrixX3d t = t0 + A.llt().solve(W.transpose() * rest_of);

  sim::example_based::Example out{std::move(name), {}};
  for (int b = 0; b < B; ++b) out.bones.push_back({R[b], t.row(b).transpose()});
  return out;
}

std::vector<Vec3> skinned(const sim::example_based::ExampleSet& set,
                          const std::vector<sim::example_based::BoneTransform>& T) {
  std::vector<Vec3> x(set.mesh.X.size(), Vec3::Zero());
  std::vector<Mat3> R;
  for (const auto& bone : T) R.push_back(bone.q.normalized().toRotationMatrix());
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t b = 0; b < T.size(); ++b)
      if (const double w = set.W(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(b)); w != 0)
        x[i] += w * (R[b] * set.mesh.X[i] + T[b].t);
  return x;
}

}  // namespace crumple::authoring
