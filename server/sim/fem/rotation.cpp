#include "server/sim/fem/rotation.h"

#include "server/sim/fem/polar_factor.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace crumple::sim::fem {

namespace {

constexpr double kRankTolerance = 1e-13;  // a singular value below this share of the largest counts as zero

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
  LaneMatrix<double> f;
  Mat3::Map(f.m) = F;
  const LaneMatrix<double> C = cofactors(f);
  const double det = first_column_dot(C, f), norm2 = squared_norm(f);
  if (!well_positive(det, norm2)) return svd_rotation(F);
  return Mat3::Map(polar_factor(f, C, det, norm2).m);
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
