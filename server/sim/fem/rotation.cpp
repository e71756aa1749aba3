#include "server/sim/fem/rotation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <cmath>

namespace crumple::sim::fem {

namespace {

constexpr double kRankTolerance = 1e-13;  // a singular value below this share of the largest counts as zero

// det F F^-T: the cross products of F's columns.
Mat3 cofactors(const Mat3& F) {
  Mat3 C;
  C.col(0) = F.col(1).cross(F.col(2));
  C.col(1) = F.col(2).cross(F.col(0));
  C.col(2) = F.col(0).cross(F.col(1));
  return C;
}

// (a, b, a x b) with b made orthogonal to a first: axes of det +1.
Mat3 right_handed(const Vec3& a, const Vec3& b) {
  Mat3 axes;
  axes.col(0) = a.normalized();
  axes.col(1) = (b - axes.col(0).dot(b) * axes.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

Mat3 svd_rotation(const Mat3& F) {
  if (!F.allFinite()) return Mat3::Identity();
  const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 s = svd.singularValues();
  const Mat3 &U = svd.matrixU(), &V = svd.matrixV();
  if (!(s(0) > 0)) return Mat3::Identity();
  if (s(1) <= kRankTolerance * s(0)) return Quat::FromTwoVectors(V.col(0), U.col(0)).toRotationMatrix();
  return right_handed(U.col(0), U.col(1)) * right_handed(V.col(0), V.col(1)).transpose();
}

Mat3 polar_rotation(const Mat3& F) {
  const double norm = F.norm();
  if (!(F.determinant() > kWellPositive * norm * norm * norm)) return svd_rotation(F);
  // Q := (gamma Q + Q^-T / gamma) / 2; gamma brings the singular values together while they are far from 1.
  Mat3 Q = F;
  bool near = false;
  for (int i = 0; i < kMaxPolarNewton; ++i) {
    const Mat3 C = cofactors(Q);
    const double det = C.col(0).dot(Q.col(0));
    const double gamma = near ? 1 : std::sqrt(C.norm() / (det * Q.norm()));
    const Mat3 next = 0.5 * gamma * Q + 0.5 / (gamma * det) * C;
    const double change = (next - Q).squaredNorm();
    Q = next;
    if (change < 1e-16) return Q;  // quadratic: a change of 1e-8 leaves an error of 1e-16
    near = change < 1e-4;
  }
  return svd_rotation(F);
}

Mat3 qr_rotation(const Mat3& F) {
  const double scale = F.norm();
  const Vec3 f1 = F.col(0), f2 = F.col(1);
  if (!(f1.norm() > kRankTolerance * scale) || !(f1.cross(f2).norm() > kRankTolerance * scale * f1.norm()))
    return svd_rotation(F);
  return right_handed(f1, f2);
}

Mat3 rotation(const Mat3& F, RotationRule rule) {
  if (rule == RotationRule::polar_qr && F.determinant() < kQrVolumeRatio) return qr_rotation(F);
  return polar_rotation(F);
}

}  // namespace crumple::sim::fem
