#include "server/rig/scene_messages.h"

#include "server/scene_convert/geometry_convert.h"

namespace crumple::rig {

v1::Body& add_body(v1::Scene& scene, const std::string& name, const Vec3& position,
                   const std::array<float, 3>& colour) {
  v1::Body& body = *scene.add_bodies();
  body.set_name(name);
  *body.mutable_pose()->mutable_position() = scene_convert::to_message(position);
  body.mutable_colour()->set_r(colour[0]);
  body.mutable_colour()->set_g(colour[1]);
  body.mutable_colour()->set_b(colour[2]);
  return body;
}

void add_ground(v1::Scene& scene) {
  v1::RigidBody& ground = *add_body(scene, "ground", Vec3::Zero(), {0.42f, 0.43f, 0.45f}).mutable_rigid();
  ground.set_kind(v1::RigidBody::FIXED);
  ground.set_friction(0.8);
  ground.add_shapes()->mutable_plane();
}

void set_parameters(v1::ExampleBody& body, double size, double mass, double speed) {
  v1::ExampleParameters& parameters = *body.mutable_parameters();
  parameters.set_alpha(36 / size);
  parameters.set_gamma(0.88 * size);
  parameters.set_beta(0.014 * mass * speed);
}

}  // namespace crumple::rig
