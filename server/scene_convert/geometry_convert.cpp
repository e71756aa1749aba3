#include "server/scene_convert/geometry_convert.h"

#include "server/sim/limits.h"

namespace crumple::scene_convert {
namespace {

constexpr double kMaxRotationVector = 1e3;  // [rad]

}  // namespace

Vec3 to_vec3(const v1::Vec3& message) { return {message.x(), message.y(), message.z()}; }

Vec3 to_vec3(bool given, const v1::Vec3& message, const Vec3& missing) { return given ? to_vec3(message) : missing; }

Result<Quat> to_rotation(const v1::Quaternion& message, const std::string& field) {
  const Quat q(message.w(), message.x(), message.y(), message.z());
  const double length = q.coeffs().stableNorm();
  if (!(length >= 1e-6 && length <= 1e6))
    return invalid(field, "has length " + sim::number_text(length) + ", must be in [1e-6, 1e6]");
  return Quat(q.coeffs() / length);
}

Result<Pose> to_pose(const v1::Pose& message, const std::string& field) {
  Pose pose;
  pose.p_WB = to_vec3(message.position());
  if (message.has_quaternion()) {
    const Result<Quat> q = to_rotation(message.quaternion(), field + ".quaternion");
    if (!q) return std::unexpected(q.error());
    pose.R_WB = *q;
  }
  if (message.has_rotation_vector()) {
    const Vec3 r = to_vec3(message.rotation_vector());
    sim::FirstBreach breach;
    breach.vector(r, kMaxRotationVector, field + ".rotation_vector");
    if (!breach.ok()) return std::unexpected(breach.result().error());
    pose.R_WB = Eigen::AngleAxisd(r.norm(), r.stableNormalized());
  }
  return pose;
}

v1::Vec3 to_message(const Vec3& v) {
  v1::Vec3 message;
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
  return message;
}

v1::Quaternion to_message(const Quat& q) {
  v1::Quaternion message;
  message.set_w(q.w());
  message.set_x(q.x());
  message.set_y(q.y());
  message.set_z(q.z());
  return message;
}

v1::Pose to_message(const Pose& pose) {
  v1::Pose message;
  *message.mutable_position() = to_message(pose.p_WB);
  *message.mutable_quaternion() = to_message(pose.R_WB);
  return message;
}

}  // namespace crumple::scene_convert
