#include "client/sdk/simulation_client.h"

namespace crumple::client {
namespace {

void set(v1::Vec3* message, const Vec3& v) {
  message->set_x(v.x());
  message->set_y(v.y());
  message->set_z(v.z());
}

}  // namespace

v1::Command impulse_command(const std::string& body, const Vec3& impulse, const Vec3& point) {
  v1::Command command;
  v1::ApplyImpulse& apply = *command.mutable_apply_impulse();
  apply.set_body(body);
  set(apply.mutable_impulse(), impulse);
  set(apply.mutable_point(), point);
  return command;
}

v1::Command force_command(const std::string& body, const Vec3& force, const Vec3& point, double duration) {
  v1::Command command;
  v1::ApplyForce& apply = *command.mutable_apply_force();
  apply.set_body(body);
  set(apply.mutable_force(), force);
  set(apply.mutable_point(), point);
  apply.set_duration(duration);
  return command;
}

}  // namespace crumple::client
