#pragma once

#include "common/error.h"
#include "common/types.h"
#include "crumple/v1/geometry.pb.h"

#include <string>

namespace crumple::scene_convert {

Vec3 to_vec3(const v1::Vec3& message);
// The message's value where it is given, else `missing`.
Vec3 to_vec3(bool given, const v1::Vec3& message, const Vec3& missing);

// Unit quaternion. Errors: a component that is not finite, a length outside [1e-6, 1e6].
Result<Quat> to_rotation(const v1::Quaternion& message, const std::string& field);
// Errors: those of the rotation; the position is for the scene's gate.
Result<Pose> to_pose(const v1::Pose& message, const std::string& field);

v1::Vec3 to_message(const Vec3& v);
v1::Quaternion to_message(const Quat& q);
v1::Pose to_message(const Pose& pose);

}  // namespace crumple::scene_convert
