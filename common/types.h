#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>

// The vocabulary that server and client share: Eigen aliases, ids and poses. SI units everywhere.
namespace crumple {

using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Mat3 = Eigen::Matrix3d;
using Mat34 = Eigen::Matrix<double, 3, 4>;
using Quat = Eigen::Quaterniond;

using Tet = std::array<int, 4>;       // node ids; det(x1-x0, x2-x0, x3-x0) > 0 at rest
using Triangle = std::array<int, 3>;  // vertex ids, counter-clockwise seen from outside

using BodyId = std::uint32_t;  // index of a body in its scene

// R_WB turns B-axes into W-axes, p_WB is B's origin seen from W [m]: p_W = R_WB * p_B + p_WB.
struct Pose {
  Quat R_WB = Quat::Identity();
  Vec3 p_WB = Vec3::Zero();

  Vec3 operator*(const Vec3& p_B) const { return R_WB * p_B + p_WB; }
};

}  // namespace crumple
