#include "server/lab/scene_bodies.h"

namespace crumple::lab {

using sim::BodyDescription;

BodyDescription plane_body(const std::string& name, const Vec3& normal, double offset, double friction) {
  BodyDescription body{.name = name};
  sim::RigidModel model{.kind = sim::RigidKind::fixed};
  model.shapes.push_back({Pose{}, sim::Plane{normal, offset}});
  model.friction = friction;
  body.model = model;
  return body;
}

BodyDescription solid_body(const std::string& name, const sim::Shape& shape, sim::RigidKind kind,
                           const Vec3& position) {
  BodyDescription body{.name = name};
  body.pose.p_WB = position;
  sim::RigidModel model{.kind = kind};
  model.shapes.push_back({Pose{}, shape});
  body.model = model;
  return body;
}

}  // namespace crumple::lab
