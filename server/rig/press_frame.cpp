#include "server/rig/press_frame.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace crumple::rig {

namespace {

// R, t with R a_i + t closest to b_i by least squares (Kabsch).
Pose closest_motion(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  Vec3 mean_a = Vec3::Zero(), mean_b = Vec3::Zero();
  for (std::size_t i = 0; i < a.size(); ++i)
    mean_a += a[i] / static_cast<double>(a.size()), mean_b += b[i] / static_cast<double>(a.size());
  Mat3 A = Mat3::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) A += (b[i] - mean_b) * (a[i] - mean_a).transpose();
  const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Mat3 R = svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  return {Quat(R), mean_b - R * mean_a};
}

}  // namespace

PressFrame::PressFrame(const std::vector<Vec3>& X, int axis, bool from_max)
    : up(Quat::FromTwoVectors((from_max ? 1 : -1) * Vec3::Unit(axis), Vec3::UnitY())) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : X) box.extend(up * p);
  foot = Vec3(box.center().x(), box.min().y(), box.center().z());
  extent = box.sizes().y();
  size = box.sizes().maxCoeff();
}

Result<PressFrame::Released> PressFrame::released(const std::vector<Vec3>& in_press, const std::vector<Vec3>& rest) const {
  Released out;
  Eigen::AlignedBox3d box;
  for (const Vec3& p : in_press) {
    if (!p.allFinite())
      return std::unexpected(Error{ErrorCode::internal, "crush", "ended in a state that is not finite"});
    box.extend(p);
    out.x.push_back(from_press(p));
  }
  out.thickness = box.sizes().y() / extent;
  const Pose back = closest_motion(out.x, rest);
  for (Vec3& p : out.x) p = back * p;
  return out;
}

}  // namespace crumple::rig
